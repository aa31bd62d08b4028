#pragma once
/// Options that exclude each other.

#include <initializer_list>
#include <string>

#include "cli/command_line.h"

namespace esvr::vdb2esvr {

/// \throws UsageError  one of the options was given, which `given` excludes
inline void refuseWith(const cli::Arguments& a, const std::string& given,
                       std::initializer_list<const char*> options) {
  for (const char* option : options)
    if (a.has(option) && !a.values[option].defaulted())
      throw UsageError("--" + given + " cannot be combined with --" + option);
}

}  // namespace esvr::vdb2esvr
