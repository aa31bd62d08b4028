#pragma once
/// VDB files as hosts write them, made with OpenVDB itself: inputs for the tests of the programs.

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
  std::vector<InputVoxel> voxels{};  ///< the active ones
  float background = 0.0f;
  bool levelSet = false;
  InputMap map = InputMap::kUniform;
};

inline constexpr const char* kInputCreator = "Houdini/SOP_OpenVDB_Write";

/// Float grids with a custom metadata item each, in a file whose `creator` is kInputCreator.
void writeInput(const std::filesystem::path& path, const std::vector<InputGrid>& grids);

/// A bool, an int32, a vec3s and a points grid, named after their types, and the grids given.
void writeMixedInput(const std::filesystem::path& path, const std::vector<InputGrid>& grids);

/// A round body of soft edge about `center`, its middle at `peak` above `background`.
[[nodiscard]] std::vector<InputVoxel> softBall(Coord center, float peak = 1.0f,
                                               float background = 0.0f);

/// A Gaussian of standard deviation `reach` / 3 about the origin, cut off at the distance `reach`:
/// smooth and large, so that ellipsoids are much smaller than voxels.
[[nodiscard]] std::vector<InputVoxel> cloud(int reach);

/// The distance from the surface of a sphere of radius 8 about the origin, in the cube of `reach`.
[[nodiscard]] std::vector<InputVoxel> distances(int reach);

}  // namespace esvr::test
