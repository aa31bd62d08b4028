#pragma once
/// Messages for people. They go to stderr, because stdout is for data. Any thread may print them.

#include <string>

namespace esvr::cli {

enum class Verbosity { kQuiet, kNormal, kVerbose };

class Log {
 public:
  Log(std::string program, Verbosity verbosity)
      : program_(std::move(program)), verbosity_(verbosity) {}

  /// Prints a message unless --quiet was given.
  void info(const std::string& message) const;
  /// Prints a message if --verbose was given.
  void detail(const std::string& message) const;
  /// Prints an error after which the program continues, also with --quiet.
  void error(const std::string& message) const;
  /// Prints a warning that something was not done as asked, unless --quiet was given.
  void warning(const std::string& message) const;

 private:
  std::string program_;
  Verbosity verbosity_;
};

}  // namespace esvr::cli
