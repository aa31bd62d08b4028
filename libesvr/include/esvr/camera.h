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

/// What decides how large fitCamera shows a box.
enum class Framing {
  kBox,  ///< the box itself, as the camera sees it
  /// The box in all pictures of a full turn about pivotOf(). The pictures have the same scale.
  kTurn,
  /// The sphere around the box, which touches the edges of the picture. The scale depends neither
  /// on the direction nor on a turn, so that measured speeds are comparable.
  kSphere
};

/// The parameters of a camera that are given; fitCamera chooses the others so that the picture
/// shows all of a box.
struct CameraWish {
  std::optional<Vec3> eye{}, center{}, up{};
  std::optional<double> fov{}, height{};
  Projection projection = Projection::kPerspective;
  Framing framing = Framing::kBox;
  double freeRight = 0.0;  ///< share of the width, below 0.4, that stays free at the right edge
  /// Direction from the center to the eye if the eye is not given; the default is a little above and
  /// to the right.
  std::optional<Vec3> direction{};
};

/// The share of the picture's width or height, whichever is tighter, that a fitted box takes.
inline constexpr double kFilledShare = 0.9;

/// Makes a camera that sees all of a box. By default it looks from a little above and from the
/// right, with y upwards. Its place, and the height of an orthographic picture, follow exactly from
/// the projected corners of the box: they take kFilledShare of the picture in its tighter direction
/// and are as far from one edge as from the opposite one. The box is drawn up to one voxel outside
/// the places of its outermost voxels, because values are interpolated up to there.
///
/// If `center` or `eye` is given, the box is not moved to the middle; the corner that is farthest
/// from the middle of the picture then takes half of kFilledShare. If the eye of a perspective
/// camera or the height of an orthographic picture is given, nothing is fitted.
/// \param box  a box that is not empty
[[nodiscard]] Camera fitCamera(const Box& box, const CameraWish& wish, Resolution resolution);

/// The point about which the pictures of Framing::kTurn turn: the center that was given, or the
/// middle of the box.
[[nodiscard]] Vec3 pivotOf(const Box& box, const CameraWish& wish);

/// Turns a camera about the axis through `pivot` along `up`, counterclockwise as seen from above.
[[nodiscard]] Camera turned(const Camera& camera, double degrees, const Vec3& pivot);
/// Turns a camera about the point that it looks at.
[[nodiscard]] inline Camera turned(const Camera& camera, double degrees) {
  return turned(camera, degrees, camera.center);
}

/// Validates a camera and a resolution.
/// \throws UsageError  a number is not finite; eye and center are equal; up has no length or is
///                     parallel to the view; fov is not between 0 and 180; height is not positive;
///                     the picture has no pixels or a side above kMaxSide
void checkCamera(const Camera& camera, Resolution resolution);

}  // namespace esvr
