#pragma once
/// Makes OpenVDB grids from volumes, and writes .vdb files of them.

#include "vdb/open_vdb.h"

#include <filesystem>
#include <span>

#include "esvr/vdb_io.h"

namespace esvr::vdb {

/// When the leaves of a grid get their voxels.
enum class LeafVoxels {
  kInMemory,    ///< at once
  kWhenWritten  ///< one leaf after the other, when the grid is written, except in a level set
};

/// A grid with the voxels of the volume and the properties of the descriptor: a DoubleGrid if the
/// source was double, else a FloatGrid. Inactive voxels hold the background. In a level set whose
/// background is positive, a flood fill gives inactive voxels and empty space their sign.
/// \param grid  must outlive the result if leaves get their voxels when they are written
/// \throws UsageError  the grid is to be saved as half, which cannot hold its values
openvdb::GridBase::Ptr makeOpenVdbGrid(const VolumeGrid& grid, const WriteOptions& options,
                                       LeafVoxels voxels = LeafVoxels::kInMemory);

/// A grid of the vectors: of type vec3d if the source was double, else vec3s. In memory, it has no tiles.
/// \throws UsageError  as for a grid of numbers
openvdb::GridBase::Ptr makeOpenVdbGrid(const VectorGrid& grid, const WriteOptions& options,
                                       LeafVoxels voxels = LeafVoxels::kWhenWritten);

/// A grid of the type of the voxels. Its leaves get their voxels when it is written.
/// \param grid  must outlive the result
openvdb::GridBase::Ptr makeOpenVdbGrid(const PackedGrid& grid, const WriteOptions& options);

/// Implements writeGrids for .vdb files. Writes to an existing empty file.
/// \throws std::ios_base::failure  the disk is full
void writeOpenVdb(const std::filesystem::path& path, std::span<const MetaItem> fileMetadata,
                  std::span<const GridToWrite> grids, const WriteOptions& options);

}  // namespace esvr::vdb
