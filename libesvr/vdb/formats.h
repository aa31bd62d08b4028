#pragma once
/// The readers of both formats, which vdb_io.cpp chooses from. Grids are given by their places in the
/// file. Errors do not name the file. The unique names of summaries are not set.
///
/// And the writer of .vdb files, which makes OpenVDB grids from volumes, of them.

#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "esvr/vdb_io.h"
#include "vdb/files.h"
#include "vdb/open_vdb.h"

namespace esvr::vdb {

// Of .vdb files (read_vdb.cpp).
VdbSummary inspectOpenVdb(InputFile& file);
VolumeGrid readOpenVdbGrid(InputFile& file, std::size_t place, const ReadOptions& options);
VolumeGrid readOpenVdbComponent(InputFile& file, std::size_t place, std::size_t component,
                                const ReadOptions& options);
VectorGrid readOpenVdbVector(InputFile& file, std::size_t place, const ReadOptions& options);
PackedGrid readOpenVdbPacked(InputFile& file, std::size_t place, const ReadOptions& options);
/// \throws BadInput, MemoryExceeded  as for readCarried
std::vector<CarriedGrid> readOpenVdbCarried(InputFile& file, std::span<const std::size_t> places,
                                            const ReadOptions& options);

// Of .nvdb files (read_nvdb.cpp).
/// True if the file begins as a NanoVDB file does.
bool beginsAsNanoVdb(InputFile& file);
VdbSummary inspectNanoVdb(InputFile& file);
VolumeGrid readNanoVdbGrid(InputFile& file, std::size_t place, const ReadOptions& options);
VolumeGrid readNanoVdbComponent(InputFile& file, std::size_t place, std::size_t component,
                                const ReadOptions& options);
VectorGrid readNanoVdbVector(InputFile& file, std::size_t place, const ReadOptions& options);

// Of both (vdb_io.cpp).
/// \throws BadInput  the file has no grid at this place
void requireGrid(std::size_t place, std::size_t grids);
/// The vectors of components that are read one after the other. Later components get the memory that earlier ones leave.
VectorGrid joinedComponents(
    ReadOptions options,
    const std::function<VolumeGrid(std::size_t component, const ReadOptions& options)>& read);
/// The reason, for the user, why a grid of this type is skipped.
std::string notAFloatType(const std::string& valueType);

// ---- Writers of .vdb files

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

/// Runs body(g) for each grid. An error that names the grid gets its unique name.
void forEachNamed(std::span<const GridToWrite> grids, const std::function<void(std::size_t)>& body);

/// Implements writeGrids for .vdb files. Writes to an existing empty file.
/// \throws std::ios_base::failure  the disk is full
void writeOpenVdb(const std::filesystem::path& path, std::span<const MetaItem> fileMetadata,
                  std::span<const GridToWrite> grids, const WriteOptions& options);

}  // namespace esvr::vdb
