#pragma once
/// The options --max-memory and --scratch, which limit the memory of a program.

#include <cstdint>

#include "cli/command_line.h"
#include "esvr/memory_limit.h"
#include "esvr/voxel_memory.h"

namespace esvr::cli {

/// The memory of the host that a program may take.
struct HostMemory {
  std::uint64_t maxBytes = kNoMemoryLimit;  ///< voxels in files do not count
  VoxelMemory voxels{};                     ///< holds voxels in files if they need a large share
};

/// Adds the options.
void addHostMemory(CommandLine& line);

/// The limit, which is the value of --max-memory or a share of the memory that is available, and
/// files in the folder of --scratch.
/// \throws UsageError  the value is not a size, or the folder does not exist
[[nodiscard]] HostMemory hostMemoryOf(const Arguments& arguments);

}  // namespace esvr::cli
