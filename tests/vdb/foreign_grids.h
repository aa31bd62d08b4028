#pragma once
/// Grids and files of other programs: grids of types that are not fitted, files of NanoVDB's own writer, and
/// VDB files that are written with OpenVDB itself as inputs for the tests of the programs. It does not include
/// OpenVDB, which many of these tests do not need and which takes ten seconds to compile.

#include <openvdb/version.h>

#include <array>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "esvr/grid.h"
#include "esvr/vdb_io.h"
#include "esvr/volume.h"

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

// Inputs for the tests of the programs, and the grids of files that are not fitted.

struct InputVoxel {
  Coord at;
  float value = 0.0f;
};

enum class InputMap { kUniform, kRotated, kSheared, kFrustum };

struct InputGrid {
  std::string name = "density";
  std::vector<InputVoxel> voxels{};  ///< active voxels
  float background = 0.0f;
  bool levelSet = false;
  InputMap map = InputMap::kUniform;
  std::vector<InputVoxel> inactive{};    ///< inactive voxels that hold a value
  std::vector<InputVoxel> largeTiles{};  ///< corners of active tiles of 4096^3 voxels
  bool half = false;
};

inline constexpr const char* kInputCreator = "Houdini/SOP_OpenVDB_Write";

/// Writes float grids with a custom metadata item each. The file's `creator` is kInputCreator.
void writeInput(const std::filesystem::path& path, const std::vector<InputGrid>& grids);

/// A staggered grid of vectors, contravariant relative, with a custom metadata item and the
/// background (0, 0, 0.5). Component c of a voxel is its value times scale[c].
struct InputVectors {
  std::string name = "velocity";
  std::vector<InputVoxel> voxels{};
  std::array<float, 3> scale{1.0f, -0.5f, 0.0f};
  bool asDouble = false;
  std::vector<InputVoxel> inactive{};  ///< inactive voxels that hold a value
};

/// Writes the grid of vectors and then the float grids, as writeInput does.
void writeVectorInput(const std::filesystem::path& path, const InputVectors& vectors,
                      const std::vector<InputGrid>& grids = {});

/// Writes a bool, an int32, a vec3s and a points grid, named after their types, and the given
/// grids.
void writeMixedInput(const std::filesystem::path& path, const std::vector<InputGrid>& grids);

/// A soft ball around `center`, whose middle is at `peak` above `background`.
[[nodiscard]] std::vector<InputVoxel> softBall(Coord center, float peak = 1.0f,
                                               float background = 0.0f);

/// A Gaussian around the origin with a standard deviation of `reach` / 3, cut off at the distance
/// `reach`. It is smooth and large, so that ellipsoids are much smaller than voxels.
[[nodiscard]] std::vector<InputVoxel> cloud(int reach);

/// The distance from a sphere of radius 8 around the origin, in the cube from -reach to reach.
[[nodiscard]] std::vector<InputVoxel> distances(int reach);

inline std::vector<std::string> namesIn(const std::string& path) {
  std::vector<std::string> names;
  for (const auto& grid : inspectVdb(path).grids) names.push_back(grid.uniqueName);
  return names;
}

/// The grids of a .vdb file as bytes, without their places and the version of the format.
inline std::vector<CarriedGrid> carriedIn(const std::string& path,
                                          std::vector<std::size_t> places = {}) {
  if (places.empty()) {
    places.resize(inspectVdb(path).grids.size());
    std::iota(places.begin(), places.end(), std::size_t{0});
  }
  auto grids = readCarried(path, places);
  for (auto& grid : grids) grid.place = 0;
  return withoutVersion(std::move(grids));
}

}  // namespace esvr::test
