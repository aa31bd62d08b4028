#include "cli/log.h"

#include <iostream>

#include "cli/printable.h"

namespace esvr::cli {

void Log::info(const std::string& message) const {
  if (verbosity_ != Verbosity::kQuiet) std::cerr << printable(message) << '\n';
}

void Log::detail(const std::string& message) const {
  if (verbosity_ == Verbosity::kVerbose) std::cerr << printable(message) << '\n';
}

void Log::error(const std::string& message) const {
  std::cerr << program_ << ": " << printable(message) << '\n';
}

void Log::warning(const std::string& message) const {
  if (verbosity_ != Verbosity::kQuiet)
    std::cerr << program_ << ": warning: " << printable(message) << '\n';
}

}  // namespace esvr::cli
