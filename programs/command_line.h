#pragma once
/// A program's command line: GNU-style options, arguments, --help and --version, and what the program says of itself in the
/// texts of --help, its man page and its versions.
///
///     cli::CommandLine line({.name = "esvr-sample", ...});
///     line.argument("output", "OUT.vdb");
///     line.options()("resolution", po::value<int>()->value_name("N")->default_value(128), "...");
///     const auto parsed = line.parse(argc, argv);
///     if (!parsed) return 0;  // --help or --version was asked for, and is printed

#include <boost/program_options/options_description.hpp>
#include <boost/program_options/positional_options.hpp>
#include <boost/program_options/value_semantic.hpp>
#include <boost/program_options/variables_map.hpp>
#include <cstddef>
#include <initializer_list>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "esvr/error.h"
#include "programs/files.h"
#include "programs/option_values.h"
#include "programs/run_main.h"

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

// ---- The command line

namespace po = boost::program_options;

/// The arguments of a run, including the options that all programs have.
struct Arguments {
  po::variables_map values;
  Verbosity verbosity = Verbosity::kNormal;
  int threads = 0;  ///< 0: as many as the machine has
  InputFiles inputs{};

  [[nodiscard]] bool has(const std::string& option) const { return values.count(option) != 0; }
  template <class T>
  [[nodiscard]] const T& get(const std::string& option) const {
    return values[option].as<T>();
  }
  /// Nothing if the option was not given and has no default.
  template <class T>
  [[nodiscard]] std::optional<T> find(const std::string& option) const {
    return has(option) ? std::optional<T>(get<T>(option)) : std::nullopt;
  }
  /// The values of an option that may be repeated.
  template <class T = std::string>
  [[nodiscard]] std::vector<T> all(const std::string& option) const {
    return find<std::vector<T>>(option).value_or(std::vector<T>{});
  }
  /// False if the option only has its default.
  [[nodiscard]] bool isGiven(const std::string& option) const {
    return has(option) && !values[option].defaulted();
  }
};

class CommandLine {
 public:
  explicit CommandLine(ProgramText text);

  /// The program's own options.
  po::options_description& options() { return own_; }

  /// Names the options that --help shows, so that it fits on two screens. `--help expert` shows the
  /// others and ProgramText::details. Without this call, --help shows all options.
  void mainOptions(std::vector<std::string> names) { main_ = std::move(names); }

  /// Adds an argument without a dash. Arguments are taken in this order; the value is a
  /// std::string.
  /// \param shown  name in the usage text: "OUT.vdb"
  void argument(const std::string& name, const std::string& shown);
  /// Adds an argument that may be left out. Such arguments come last.
  void optionalArgument(const std::string& name, const std::string& shown);
  /// Adds an argument for all remaining ones. Its value is a std::vector<std::string>.
  void repeatedArgument(const std::string& name);

  /// Declares that the values of arguments or options are names of input files with volumes. They
  /// may be "-", standard input, or the name of a pipe; parse() replaces these by names of files.
  void volumeInputs(std::vector<std::string> names) { volumeInputs_ = std::move(names); }
  /// The same of other input files, such as cameras, whose readers accept a pipe.
  void textInputs(std::vector<std::string> names) { textInputs_ = std::move(names); }

  /// Adds a text that `--help NAME` prints instead of the whole help. Every program has the topics
  /// `man`, its man page, and `options`, the names of its options.
  void helpTopic(const std::string& name, const std::string& text);

  /// \return nothing if --help or --version was printed to stdout
  /// \throws UsageError  an option or an argument is invalid
  /// \throws Error  as PipedInput, for an input that comes through a pipe
  [[nodiscard]] std::optional<Arguments> parse(int argc, const char* const* argv) const;

 private:
  struct Argument {
    std::string name, shown;
    bool required;
  };
  [[nodiscard]] po::variables_map parseValues(int argc, const char* const* argv) const;
  void requireArguments(const po::variables_map& values) const;
  [[nodiscard]] std::string helpAskedFor(const po::variables_map& values,
                                         const std::string& following) const;
  [[nodiscard]] std::vector<std::string> words(const po::variables_map& values) const;
  [[nodiscard]] std::optional<std::string> topic(const std::string& name) const;
  [[nodiscard]] std::vector<OptionGroup> groups() const;
  [[nodiscard]] std::vector<std::string> longNames() const;
  [[nodiscard]] po::options_description shown(bool isExpert) const;
  [[nodiscard]] bool hasExpertHelp() const { return !main_.empty() || !text_.details.empty(); }
  [[nodiscard]] std::string helpText() const;
  [[nodiscard]] std::string expertText() const;

  ProgramText text_;
  po::options_description own_, common_;
  std::vector<std::string> main_;  ///< options that --help shows; empty: all
  std::vector<Argument> arguments_;
  std::map<std::string, std::string> helpTopics_;
  std::vector<std::string> volumeInputs_, textInputs_;  ///< names of arguments and options
  std::string rest_;  ///< the repeated argument, or a name that is not used
};

/// \throws UsageError  the value of the option is outside [low, high] or not a number
template <class T>
void requireRange(const std::string& option, T value, T low, T high) {
  if (value >= low && value <= high) return;
  const auto text = [](T number) {
    if constexpr (std::is_floating_point_v<T>)
      return shortNumber(number);
    else
      return std::to_string(number);
  };
  throw UsageError("--" + option + " must be from " + text(low) + " to " + text(high) + ", not " +
                   text(value));
}

/// The choice of an option that is given or has a default.
/// \throws UsageError  the word is unknown; the message lists the known ones
template <class T>
[[nodiscard]] T choiceOf(const Arguments& arguments, const std::string& option,
                         std::initializer_list<Choice<T>> choices) {
  return choose<T>(option, arguments.get<std::string>(option), choices);
}

/// \throws UsageError  one of the options is given, which say nothing for these files
void refuseOptions(const Arguments& arguments, const std::string& files,
                   std::initializer_list<const char*> options);

/// Adds the option --device. Its help text begins with `purpose` and ends with `more`.
void addDevice(po::options_description& options, const std::string& purpose = {},
               const std::string& more = {});

/// The value of the option, as selectDevice() or selectDevices() take it.
[[nodiscard]] std::string deviceOf(const Arguments& arguments);

}  // namespace esvr::cli
