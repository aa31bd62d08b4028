#pragma once
/// Implements writeGrids for .vdb files.

#include <filesystem>
#include <span>
#include <vector>

#include "esvr/vdb_io.h"

namespace esvr::vdb {

/// Writes to an existing empty file. \throws std::ios_base::failure  the disk is full
void writeOpenVdb(const std::filesystem::path& path, std::span<const MetaItem> fileMetadata,
                  std::span<const GridToWrite> grids, const WriteOptions& options);

/// The source's file metadata, with an item that names this library as the writer, unless it has
/// one.
std::vector<MetaItem> withWriter(std::span<const MetaItem> fileMetadata);

}  // namespace esvr::vdb
