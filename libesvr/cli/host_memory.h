#pragma once
/// The options --max-memory and --scratch, which limit the memory of a program.

#include <cstdint>
#include <filesystem>

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

/// The folder of --scratch, or that of the variable TMPDIR, or /var/tmp: /tmp is in memory on many
/// systems.
/// \throws UsageError  the folder does not exist
[[nodiscard]] std::filesystem::path scratchFolderOf(const Arguments& arguments);

/// The same without options.
[[nodiscard]] std::filesystem::path scratchFolder();

}  // namespace esvr::cli
