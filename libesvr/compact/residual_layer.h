#pragma once
/// What residuals have in common: the sum that they correct, and the layer of their codes.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "esvr/container.h"
#include "esvr/coord.h"
#include "esvr/ellipsoids.h"
#include "esvr/sparse_volume.h"
#include "esvr/voxel_layer.h"

namespace esvr::compact {

/// The codes of a residual in one brick.
struct BrickCodes {
  Coord corner;  ///< index coordinates of the brick's first voxel
  std::array<std::int32_t, kBrickVoxels> codes{};
};

/// The largest difference between two machines' evaluations of each brick.
/// \param corners  index corners of the bricks
[[nodiscard]] std::vector<double> marginsOf(const Field& field, std::span<const Coord> corners);

/// The sum in the given bricks, with all voxels active.
[[nodiscard]] SparseVolume sumIn(const StoredGrid& grid, std::span<const Coord> corners);

/// The layer of a residual. \param bricks  by increasing corners
[[nodiscard]] VoxelLayer layerOf(const std::vector<BrickCodes>& bricks, double divisor);

}  // namespace esvr::compact
