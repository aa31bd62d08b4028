#pragma once
/// Gathers the ellipsoids of all chunks of a field and prepares them for evaluation.

#include <vector>

#include "esvr/ellipsoids.h"
#include "field/support.h"

namespace esvr {

struct GatheredField {
  std::vector<LineForm> forms;                  ///< centers relative to their chunk's origin
  std::vector<KernelConstants<float>> kernels;  ///< one for all, or one for each ellipsoid
  std::vector<Coord> origins;                   ///< origins of the chunks
  std::vector<std::uint32_t> chunkOf;           ///< chunk of each ellipsoid

  [[nodiscard]] const KernelConstants<float>& kernel(std::size_t i) const {
    return kernels[kernels.size() == 1 ? 0 : i];
  }
  /// Position of a voxel relative to the origin of ellipsoid i's chunk. The difference of two
  /// 32-bit coordinates may have 33 bits.
  [[nodiscard]] std::array<float, 3> fromOrigin(std::size_t i, Coord voxel) const {
    const Coord o = origins[chunkOf[i]];
    return {float(double(voxel.x) - o.x), float(double(voxel.y) - o.y),
            float(double(voxel.z) - o.z)};
  }
};

[[nodiscard]] GatheredField gather(const Field& field);

/// Voxels by which supports are widened. The rounding of centers and forms to float32 is far
/// smaller.
inline constexpr double kRoundingSlack = 0.02;

/// The supports of all ellipsoids in index coordinates, widened by `slack` voxels.
[[nodiscard]] std::vector<Support> supports(const Field& field, double slack = kRoundingSlack);

}  // namespace esvr
