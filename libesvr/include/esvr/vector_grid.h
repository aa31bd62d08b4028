#pragma once
/// Grids of vectors. A vector grid is read, fitted and stored as three volumes, one for each
/// component.

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "esvr/grid_descriptor.h"
#include "esvr/inactive_values.h"
#include "esvr/sparse_volume.h"

namespace esvr {

inline constexpr std::size_t kComponents = 3;

/// The components x, y and z. They may have different bricks and active masks.
using VectorVolume = std::array<SparseVolume, kComponents>;

struct VectorGrid {
  GridDescriptor descriptor;  ///< its background is that of component x
  std::array<double, kComponents> background{};
  VectorVolume components;
  std::uint64_t nonFiniteReplaced = 0;  ///< components replaced as NonFinite says
  InactiveValues inactive{};            ///< of the components together
};

/// The name of a component: that of the grid with ".x", ".y" or ".z".
/// \param component  0, 1 or 2
[[nodiscard]] std::string componentName(const std::string& grid, std::size_t component);

/// The same volumes with the bricks and the active voxels that any of them has. Voxels that are
/// added to a volume have its background.
[[nodiscard]] VectorVolume aligned(const VectorVolume& vectors);

/// The lengths of the vectors, at the voxels that are active in any component. Sums of squares are
/// formed in float64.
[[nodiscard]] SparseVolume magnitudeOf(const VectorVolume& vectors);

}  // namespace esvr
