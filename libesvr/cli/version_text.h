#pragma once
/// The option --version.

#include <string>

namespace esvr::cli {

/// The versions of the program, the file format and the libraries, one in a line.
[[nodiscard]] std::string versionText(const std::string& program);

/// The version of the program, for example "0.1.0".
[[nodiscard]] std::string programVersion();

}  // namespace esvr::cli
