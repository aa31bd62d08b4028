#pragma once
/// Soft-edged tubes, which look like vessels and neurons in a scan.

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

/// A round cone in index coordinates: the union of balls whose centre moves from a to b while the
/// radius changes from radiusA to radiusB.
struct Tube {
  Vec3 a, b;
  double radiusA = 0.0, radiusB = 0.0;
};

/// The exact distance of a point to the surface, negative inside.
[[nodiscard]] double signedDistance(const Tube& tube, Vec3 p);

/// The union of tubes: 1 inside, with a soft edge of `edge` voxels to 0 outside.
class TubeShape {
 public:
  /// \param tubes  tubes that outlive all shapes narrowed from this one
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

/// The box of voxels that the tubes and their edges reach. \param tubes  at least one tube
[[nodiscard]] Box boundsOf(std::span<const Tube> tubes, double edge);

inline constexpr double kDefaultEdge = 2.0;  ///< width of a soft edge, voxels

/// Makes a volume with background 0, in which voxels above 0 are active.
[[nodiscard]] SparseVolume voxeliseTubes(std::span<const Tube> tubes, double edge,
                                         const Limits& limits);

}  // namespace esvr::samples
