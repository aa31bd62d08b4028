#pragma once
/// .vdb files behind writeGrids.

#include <filesystem>
#include <span>
#include <vector>

#include "esvr/vdb_io.h"

namespace esvr::vdb {

/// Writes into an existing empty file. \throws std::ios_base::failure  disk full
void writeOpenVdb(const std::filesystem::path& path, std::span<const MetaItem> fileMetadata,
                  std::span<const VolumeGrid> grids, const WriteOptions& options);

/// The source's file metadata and, unless it is there, an item that names us as the writer.
std::vector<MetaItem> withWriter(std::span<const MetaItem> fileMetadata);

}  // namespace esvr::vdb
