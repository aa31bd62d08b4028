#pragma once
/// Implements writeGrids for .nvdb files.

#include <filesystem>
#include <span>

#include "esvr/vdb_io.h"

namespace esvr::vdb {

/// Writes to an existing empty file.
/// \throws UsageError  NanoVDB cannot hold the grid
/// \throws std::ios_base::failure  the disk is full
void writeNanoVdb(const std::filesystem::path& path, std::span<const GridToWrite> grids,
                  const WriteOptions& options);

}  // namespace esvr::vdb
