#pragma once
/// Messages for people. They go to stderr, because stdout is for data. Any thread may print them.

#include <functional>
#include <string>
#include <utility>

namespace esvr::cli {

enum class Verbosity { kQuiet, kNormal, kVerbose };

class Log {
 public:
  /// Takes the text of a warning.
  using Warnings = std::function<void(const std::string&)>;

  /// \param warnings  takes the warnings, which are not printed then; may be empty
  Log(std::string program, Verbosity verbosity, Warnings warnings = {})
      : program_(std::move(program)), verbosity_(verbosity), warnings_(std::move(warnings)) {}

  /// Prints a message unless --quiet was given.
  void info(const std::string& message) const;
  /// Prints a message if --verbose was given.
  void detail(const std::string& message) const;
  /// Prints an error after which the program continues, also with --quiet.
  void error(const std::string& message) const;
  /// Prints a warning that something was not done as asked, unless --quiet was given.
  /// \param figure  printed in parentheses unless it is empty. Frames of a sequence, which differ
  ///                in it, have one warning without it
  void warning(const std::string& message, const std::string& figure = {}) const;

 private:
  std::string program_;
  Verbosity verbosity_;
  Warnings warnings_;
};

}  // namespace esvr::cli
