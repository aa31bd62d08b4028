#pragma once
/// Writes VDB files with OpenVDB itself, as other programs do: inputs for the tests of the
/// programs.

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "esvr/coord.h"

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

}  // namespace esvr::test
