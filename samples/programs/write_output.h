#pragma once
/// Writes the output of the sample programs.

#include <filesystem>
#include <span>

#include "cli/log.h"
#include "esvr/vdb_io.h"

namespace esvr::samples {

struct Output {
  std::filesystem::path path;
  bool overwrite = false;
};

/// Writes the grids and logs them. \throws BadInput  a grid has no active voxel
void writeOutput(const Output& output, std::span<const MetaItem> metadata,
                 std::span<const VolumeGrid> grids, const cli::Log& log);

}  // namespace esvr::samples
