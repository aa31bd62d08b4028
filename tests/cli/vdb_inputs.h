#pragma once
/// Writes VDB files with OpenVDB itself, as other programs do: inputs for the tests of the programs.
/// Reads the grids of VDB files that are not fitted.

#include <array>
#include <cstddef>
#include <filesystem>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "esvr/vdb_io.h"
#include "esvr/volume.h"
#include "vdb/foreign_grids.h"

namespace esvr::test {

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
