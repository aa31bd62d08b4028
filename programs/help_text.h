#pragma once
/// What a program says of itself: the texts of --help, its man page and its versions.

#include <boost/program_options/options_description.hpp>
#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace esvr::cli {

/// The texts of a program's --help. In `purpose`, `notes` and `details`, each line is a paragraph, which is
/// broken into lines where it is printed; lines that begin with a space have columns, and stay as
/// they are. The other texts are printed unchanged.
struct ProgramText {
  std::string name;       ///< "esvr-sample"
  std::string purpose;    ///< The text says what the program does.
  std::string usage;      ///< command lines that begin with the name
  std::string notes;      ///< input, output and exit codes; may be empty
  std::string details{};  ///< notes that only `--help expert` and the man page have; may be empty
  std::string examples;   ///< commands, each with a few words of explanation
};

/// Breaks the lines of a text between words, so that none is longer than `width` characters unless
/// it is one word. Lines that begin with a space have columns, and stay as they are.
[[nodiscard]] std::string wrapped(const std::string& text, std::size_t width);

// The man page of a program, from the texts and options of its --help.

/// A group of options of a man page.
struct OptionGroup {
  const char* title;
  const boost::program_options::options_description* options;
};

/// The man page of section 1 in the language of man(7). It has no date, so that the same sources
/// give the same bytes.
[[nodiscard]] std::string manPage(const ProgramText& text, const std::vector<OptionGroup>& groups);

/// The long names of the options with their dashes, one on a line, for completion in a shell.
[[nodiscard]] std::string optionNames(const std::vector<OptionGroup>& groups);

// The option --version, and the versions in a JSON report.

/// The versions of the program, the file format and the libraries, one in a line.
[[nodiscard]] std::string versionText(const std::string& program);

/// The version of the program, for example "0.1.0".
[[nodiscard]] std::string programVersion();

/// An object with the versions of ESVR, the file format, the VDB libraries and CUDA.
[[nodiscard]] nlohmann::ordered_json versionJson();

}  // namespace esvr::cli
