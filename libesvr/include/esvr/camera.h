#pragma once
/// The place that a picture is taken from. Everything is in voxels of the grid's index space: voxel
/// (i, j, k) lies at (i, j, k), and the grid's transform takes no part.

#include <array>
#include <optional>

#include "esvr/coord.h"

namespace esvr {

using Vec3 = std::array<double, 3>;

enum class Projection { kPerspective, kOrthographic };

struct Camera {
  Vec3 eye{0.0, 0.0, 1.0};
  Vec3 center{0.0, 0.0, 0.0};  ///< the point in the middle of the picture
  Vec3 up{0.0, 1.0, 0.0};      ///< a direction that points upwards in the picture
  Projection projection = Projection::kPerspective;
  double fov = 30.0;    ///< degrees from the lower to the upper edge; perspective only
  double height = 1.0;  ///< voxels from the lower to the upper edge; orthographic only
};

struct Resolution {
  static constexpr int kMaxSide = 32767;  ///< the renderers keep pixels' numbers in 16 bits

  int width = 800, height = 800;  ///< pixels
};

/// The known part of a camera; the rest is chosen so that a box fills the picture.
struct CameraWish {
  std::optional<Vec3> eye{}, center{}, up{};
  std::optional<double> fov{}, height{};
  Projection projection = Projection::kPerspective;
};

/// The camera that sees all of a box: looks at its middle, a little from above and from the right,
/// with y upwards, from as far as its bounding sphere needs.
/// \param box  not empty
[[nodiscard]] Camera fitCamera(const Box& box, const CameraWish& wish, Resolution resolution);

/// The camera turned about the axis through `center` along `up`, counterclockwise seen from above.
[[nodiscard]] Camera turned(const Camera& camera, double degrees);

/// \throws UsageError  not finite; eye and center in one place; up of no length or along the view;
///                     fov not between 0 and 180; height not positive; fewer pixels than one, or a
///                     side above kMaxSide
void checkCamera(const Camera& camera, Resolution resolution);

}  // namespace esvr
