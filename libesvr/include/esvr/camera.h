#pragma once
/// Cameras. All lengths are voxels of the grid's index space: voxel (i, j, k) lies at (i, j, k),
/// and the grid's transform is not used.

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
  double fov = 30.0;    ///< vertical field of view in degrees; perspective only
  double height = 1.0;  ///< vertical field of view in voxels; orthographic only
};

struct Resolution {
  static constexpr int kMaxSide = 32767;  ///< largest pixel index that 16 bits can hold

  int width = 800, height = 800;  ///< pixels
};

/// The parameters of a camera that are given; fitCamera chooses the others so that the picture
/// shows all of a box.
struct CameraWish {
  std::optional<Vec3> eye{}, center{}, up{};
  std::optional<double> fov{}, height{};
  Projection projection = Projection::kPerspective;
};

/// Makes a camera that sees all of a box. By default it looks at the middle of the box from a
/// little above and from the right, with y upwards, at the distance that the bounding sphere of the
/// box requires.
/// \param box  a box that is not empty
[[nodiscard]] Camera fitCamera(const Box& box, const CameraWish& wish, Resolution resolution);

/// Turns a camera about the axis through `center` along `up`, counterclockwise as seen from above.
[[nodiscard]] Camera turned(const Camera& camera, double degrees);

/// Validates a camera and a resolution.
/// \throws UsageError  a number is not finite; eye and center are equal; up has no length or is
///                     parallel to the view; fov is not between 0 and 180; height is not positive;
///                     the picture has no pixels or a side above kMaxSide
void checkCamera(const Camera& camera, Resolution resolution);

}  // namespace esvr
