#pragma once
/// .nvdb files behind writeGrids.

#include <filesystem>
#include <span>

#include "esvr/vdb_io.h"

namespace esvr::vdb {

/// Writes into an existing empty file. \throws UsageError  what NanoVDB cannot hold;
/// std::ios_base::failure: disk full
void writeNanoVdb(const std::filesystem::path& path, std::span<const VolumeGrid> grids,
                  const WriteOptions& options);

}  // namespace esvr::vdb
