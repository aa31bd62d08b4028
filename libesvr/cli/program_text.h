#pragma once
/// What a program says of itself.

#include <string>

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

}  // namespace esvr::cli
