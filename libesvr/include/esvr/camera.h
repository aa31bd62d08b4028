#pragma once
/// Cameras. They see a grid in its proportions in the world: a camera's space has the axes of the world,
/// its origin is the place of voxel (0, 0, 0), and its unit of length is the shortest edge of a voxel.
/// Voxel (i, j, k) lies at i a + j b + k c there, with the edges a, b and c of a VoxelShape. For a grid
/// whose voxels are cubes along the axes of the world this is (i, j, k), whatever their size is.

#include <array>
#include <optional>

#include "esvr/volume.h"

namespace esvr {

using Vec3 = std::array<double, 3>;

/// The edges of a voxel in a camera's space: the steps from a voxel to the next ones along i, j and k.
struct VoxelShape {
  std::array<Vec3, 3> edges{{{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}}};

  /// True for cubes along the axes, for which the camera's space is the index space.
  [[nodiscard]] bool isCube() const { return *this == VoxelShape{}; }
  /// The place of a point of the index space.
  [[nodiscard]] Vec3 place(const Vec3& index) const;
  friend bool operator==(const VoxelShape&, const VoxelShape&) = default;
};

/// The shape of the voxels of a grid. Edges that differ from those of a cube by less than 1e-5 of their
/// length, as float32 rounds sizes of voxels, make a cube.
/// \param affine  Transform::affine of the grid
/// \return nothing for a grid without an affine transform (a frustum), or if a voxel has no volume or
///         is not finite; such a grid is drawn in its index space
[[nodiscard]] std::optional<VoxelShape> voxelShape(
    const std::optional<std::array<double, 16>>& affine);

/// A box with real-valued corners. Voxel (i, j, k) extends half a voxel to each side of (i, j, k).
struct PlaceBox {
  Vec3 low, high;
};

enum class Projection { kPerspective, kOrthographic };

struct Camera {
  Vec3 eye{0.0, 0.0, 1.0};
  Vec3 center{0.0, 0.0, 0.0};  ///< the point in the middle of the picture
  Vec3 up{0.0, 1.0, 0.0};      ///< a direction that points upwards in the picture
  Projection projection = Projection::kPerspective;
  double fov = 30.0;  ///< vertical field of view in degrees; perspective only
  double height =
      1.0;             ///< vertical field of view in units of the camera's space; orthographic only
  VoxelShape voxel{};  ///< of the grid that is drawn
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
  VoxelShape voxel{};  ///< of the grid that is drawn
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
/// \param box  of voxels, in index space; not empty
/// \throws UsageError  the field of view is out of range
[[nodiscard]] Camera fitCamera(const Box& box, const CameraWish& wish, Resolution resolution);

/// The point about which the pictures of Framing::kTurn turn: the center that was given, or the
/// middle of the box, in the camera's space.
[[nodiscard]] Vec3 pivotOf(const Box& box, const CameraWish& wish);

/// Turns a camera about the axis through `pivot` along `up`, counterclockwise as seen from above.
[[nodiscard]] Camera turned(const Camera& camera, double degrees, const Vec3& pivot);
/// Turns a camera about the point that it looks at.
[[nodiscard]] inline Camera turned(const Camera& camera, double degrees) {
  return turned(camera, degrees, camera.center);
}

/// Validates a camera and a resolution.
/// \throws UsageError  a number is not finite; eye and center are equal; up has no length or is
///                     parallel to the view, or their distance is not finite; fov is not between 0
///                     and 180; height is not positive; the voxels have no volume;
///                     the picture has no pixels or a side above kMaxSide
void checkCamera(const Camera& camera, Resolution resolution);

}  // namespace esvr
