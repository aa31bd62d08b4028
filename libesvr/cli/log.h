#pragma once
/// Messages for people, on stderr: stdout is for data.

#include <string>

namespace esvr::cli {

enum class Verbosity { kQuiet, kNormal, kVerbose };

class Log {
 public:
  Log(std::string program, Verbosity verbosity)
      : program_(std::move(program)), verbosity_(verbosity) {}

  /// Prints what someone at a terminal wants to know; not under --quiet.
  void info(const std::string& message) const;
  /// Only under --verbose.
  void detail(const std::string& message) const;
  /// Something was done otherwise than asked; not under --quiet.
  void warning(const std::string& message) const;

 private:
  std::string program_;
  Verbosity verbosity_;
};

}  // namespace esvr::cli
