#pragma once
/// --max-memory, which bounds what an input may ask for.

#include <cstdint>

#include "cli/command_line.h"

namespace esvr::cli {

/// Adds the option, as it appears in --help.
void addMaxMemory(CommandLine& line);

/// Bytes: the option's, else a share of the memory that is available. \throws UsageError  no size
[[nodiscard]] std::uint64_t maxMemoryOf(const Arguments& arguments);

}  // namespace esvr::cli
