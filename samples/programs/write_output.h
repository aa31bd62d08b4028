#pragma once
/// The last step of every sample program.

#include <filesystem>
#include <span>

#include "cli/log.h"
#include "esvr/vdb_io.h"

namespace esvr::samples {

struct Output {
  std::filesystem::path path;
  bool overwrite = false;
};

/// Writes the grids and says what was written. \throws BadInput  a grid has no active voxel
void writeOutput(const Output& output, std::span<const MetaItem> metadata,
                 std::span<const VolumeGrid> grids, const cli::Log& log);

}  // namespace esvr::samples
