#pragma once
/// Grids and files of other programs, which the tests of programs need, too: grids of types that are not
/// fitted, and files of NanoVDB's own writer. It does not include OpenVDB, which many of these tests do
/// not need and which takes ten seconds to compile.

#include <openvdb/version.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "esvr/grid.h"
#include "esvr/vdb_io.h"

namespace openvdb {
OPENVDB_USE_VERSION_NAMESPACE
namespace OPENVDB_VERSION_NAME {
class GridBase;
}
}  // namespace openvdb

namespace esvr::test {

using OpenVdbGrid = std::shared_ptr<openvdb::GridBase>;

/// A grid of a registered type without a voxel, as in emptyGrid("Tree_vec3s_5_4_3", "v"). OpenVDB's
/// registry makes it: the templates of these types take minutes to compile.
OpenVdbGrid emptyGrid(const std::string& treeType, const std::string& name);

/// The grids without the version of their file's format, which is that of the library that wrote the
/// file. The bytes are the same in all versions that are carried.
[[nodiscard]] inline std::vector<CarriedGrid> withoutVersion(std::vector<CarriedGrid> grids) {
  for (CarriedGrid& grid : grids) grid.vdbVersion = 0;
  return grids;
}

enum class NanoCodec { kNone, kZip, kBlosc };

/// Writes grids of floats, doubles or vectors of three floats.
void saveNano(const std::filesystem::path& path, const std::vector<OpenVdbGrid>& grids,
              NanoCodec codec = NanoCodec::kNone);
/// The same without a directory: the buffers of the grids, one after the other.
void saveNanoBuffers(const std::filesystem::path& path, const std::vector<OpenVdbGrid>& grids);
/// Writes a grid of floats in one of NanoVDB's value types.
void saveNanoAs(const std::filesystem::path& path, const openvdb::GridBase& grid,
                NanoValues values);

}  // namespace esvr::test
