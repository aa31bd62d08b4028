#pragma once
/// The option --max-memory, which limits the memory that an input may need.

#include <cstdint>

#include "cli/command_line.h"

namespace esvr::cli {

/// Adds the option.
void addMaxMemory(CommandLine& line);

/// The limit in bytes: the value of the option, or a share of the memory that is available.
/// \throws UsageError  the value is not a size
[[nodiscard]] std::uint64_t maxMemoryOf(const Arguments& arguments);

}  // namespace esvr::cli
