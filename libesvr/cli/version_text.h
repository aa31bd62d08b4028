#pragma once
/// --version.

#include <string>

namespace esvr::cli {

/// The program's version and those of all that it reads, writes and runs on, one a line.
[[nodiscard]] std::string versionText(const std::string& program);

/// "0.1.0".
[[nodiscard]] std::string programVersion();

}  // namespace esvr::cli
