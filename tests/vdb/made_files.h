#pragma once
/// Makes files with OpenVDB itself, so that the reader is tested with files of another writer, and
/// compares volumes and grids bit by bit.

#include <gtest/gtest.h>
#include "vdb/open_vdb.h"

#include <filesystem>
#include <string>
#include <vector>

#include "esvr/vdb_io.h"
#include "fit/volumes.h"
#include "metrics/volumes.h"
#include "support/files.h"
#include "support/machine.h"

namespace esvr::test {

/// The folder of the real volumes; empty if none is configured.
inline std::filesystem::path dataDir() { return ESVR_DATA_DIR; }

/// A float grid with one leaf of three active voxels, named "density".
openvdb::FloatGrid::Ptr smallGrid(float background = 0.0f);

/// A grid of a type that open_vdb.h does not name, such as Vec3IGrid, without a voxel. OpenVDB's registry makes it: the
/// templates of a tree that is made here, with all virtual functions, are a tenth of this program.
template <class Grid>
typename Grid::Ptr registeredGrid() {
  openvdb::initialize();
  return openvdb::StaticPtrCast<Grid>(openvdb::GridBase::createGrid(Grid::TreeType::treeType()));
}

/// Writes with OpenVDB's own writer, by default with its default compression.
void save(const std::filesystem::path& path, const openvdb::GridPtrVec& grids,
          const openvdb::MetaMap& metadata = {});
void saveCompressed(const std::filesystem::path& path, const openvdb::GridPtrVec& grids,
                    std::uint32_t compression);

/// Reads one grid with OpenVDB's own reader.
openvdb::GridBase::Ptr load(const std::filesystem::path& path, const std::string& name);

/// A grid with these active voxels, in any order; the rest is background.
VolumeGrid gridOf(const std::string& name, const std::vector<Voxel>& voxels,
                  float background = 0.0f);

/// Fails unless the descriptors and the bits of the voxels are the same.
void expectSame(const VolumeGrid& actual, const VolumeGrid& expected);

/// Reads all grids of a file; they must be sound and finite.
/// \return false where the file is refused, or where it takes more memory than allowed
bool readable(const std::filesystem::path& path, const ReadOptions& options);

}  // namespace esvr::test
