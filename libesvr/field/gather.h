#pragma once
/// A field's ellipsoids as one list, prepared for evaluation.

#include <vector>

#include "esvr/ellipsoids.h"
#include "field/support.h"

namespace esvr {

struct GatheredField {
  std::vector<LineForm> forms;                  ///< centers relative to their chunk's origin
  std::vector<KernelConstants<float>> kernels;  ///< one, or one an ellipsoid
  std::vector<Coord> origins;                   ///< the chunks' origins
  std::vector<std::uint32_t> chunkOf;           ///< each ellipsoid's chunk

  [[nodiscard]] const KernelConstants<float>& kernel(std::size_t i) const {
    return kernels[kernels.size() == 1 ? 0 : i];
  }
  /// A voxel's place relative to the origin of ellipsoid i's chunk. The difference may have 33
  /// bits.
  [[nodiscard]] std::array<float, 3> fromOrigin(std::size_t i, Coord voxel) const {
    const Coord o = origins[chunkOf[i]];
    return {float(double(voxel.x) - o.x), float(double(voxel.y) - o.y),
            float(double(voxel.z) - o.z)};
  }
};

[[nodiscard]] GatheredField gather(const Field& field);

/// Supports in index coordinates, padded by kRoundingSlack.
[[nodiscard]] std::vector<Support> supports(const Field& field);

/// Voxels by which supports are padded: float32 centers and forms are off by far less.
inline constexpr double kRoundingSlack = 0.02;

}  // namespace esvr
