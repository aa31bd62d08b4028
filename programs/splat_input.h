#pragma once
/// Files of splats as input of a program: their options, and the grids that become of them.

#include <filesystem>
#include <memory>
#include <optional>

#include "esvr/splats.h"
#include "programs/command_line.h"
#include "programs/memory.h"
#include "programs/messages.h"

namespace esvr::cli {

/// What options say about splats in the input.
struct SplatInput {
  std::optional<double> voxelSize, densityScale;
  std::optional<UpAxis> up = UpAxis::kY;
};

/// Adds --voxel-size, --density-scale and --up.
void addSplatInput(po::options_description& options);

/// \throws UsageError  an option is invalid
[[nodiscard]] SplatInput splatInputOf(const Arguments& arguments);

/// True if the name of a file says that it has splats.
[[nodiscard]] bool isSplatFile(const std::filesystem::path& path);

/// Reads splats, makes grids of them, and says what was left out.
/// \throws BadInput, MemoryExceeded  as for readSplats and makeSplatGrids
[[nodiscard]] SplatGrids readSplatGrids(const std::filesystem::path& path, const SplatInput& input,
                                        const HostMemory& memory, const Log& log);

}  // namespace esvr::cli
