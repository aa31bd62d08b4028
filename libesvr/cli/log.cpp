#include "cli/log.h"

#include <iostream>

#include "cli/printable.h"

namespace esvr::cli {
namespace {

/// Writes the line at once, so that the lines of several threads do not mix.
void printLine(const std::string& line) { std::cerr << line + '\n'; }

}  // namespace

void Log::info(const std::string& message) const {
  if (verbosity_ != Verbosity::kQuiet) printLine(printableMessage(message));
}

void Log::detail(const std::string& message) const {
  if (verbosity_ == Verbosity::kVerbose) printLine(printableMessage(message));
}

void Log::error(const std::string& message) const {
  printLine(program_ + ": " + printableMessage(message));
}

void Log::warning(const std::string& message, const std::string& figure) const {
  if (warnings_) return warnings_(message);
  const std::string text = figure.empty() ? message : message + " (" + figure + ')';
  if (verbosity_ != Verbosity::kQuiet) printLine(program_ + ": warning: " + printableMessage(text));
}

}  // namespace esvr::cli
