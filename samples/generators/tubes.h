#pragma once
/// Soft-edged tubes: what vessels and neurons look like in a scanner.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "esvr/coord.h"
#include "generators/sample_options.h"
#include "generators/vec3.h"
#include "generators/voxelise.h"

namespace esvr::samples {

/// A round cone: all balls whose centre goes from a to b while the radius goes from radiusA to
/// radiusB. Index coordinates.
struct Tube {
  Vec3 a, b;
  double radiusA = 0.0, radiusB = 0.0;
};

/// Distance of a point to the surface, negative inside; exact.
[[nodiscard]] double signedDistance(const Tube& tube, Vec3 p);

/// The union of tubes: 1 inside, falling to 0 over `edge` voxels across the surface.
class TubeShape {
 public:
  /// \param tubes  must outlive all that is narrowed from this shape
  TubeShape(std::span<const Tube> tubes, double edge);

  [[nodiscard]] std::optional<TubeShape> within(const Ball& ball) const;
  [[nodiscard]] Sample at(Vec3 p) const;

 private:
  TubeShape(std::span<const Tube> tubes, double edge, std::vector<std::uint32_t> near)
      : tubes_(tubes), edge_(edge), near_(std::move(near)) {}

  std::span<const Tube> tubes_;
  double edge_;
  std::vector<std::uint32_t> near_;  ///< the tubes that reach where this shape is used
};

/// The box of voxels that the tubes and their edges reach. \param tubes  not empty
[[nodiscard]] Box boundsOf(std::span<const Tube> tubes, double edge);

inline constexpr double kDefaultEdge = 2.0;  ///< voxels

/// Background 0; active where the value is above 0.
[[nodiscard]] SparseVolume voxeliseTubes(std::span<const Tube> tubes, double edge,
                                         const Limits& limits);

}  // namespace esvr::samples
