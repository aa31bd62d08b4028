#pragma once
/// The coordinates of a camera: right, up and forward, from the place where rays begin. Points of the
/// picture have coordinates (x, y) in the picture's plane: for a perspective camera it lies at a
/// distance of 1 in front of the eye, and for parallel rays x and y are lengths. Lengths are those of
/// the camera's space (esvr/camera.h), and places are those of the grid's index space, so that rays are
/// marched through voxels. The struct holds plain numbers, so that it can be copied to a device.

#include "esvr/camera.h"
#include "render/vector.h"

namespace esvr {

/// A box without a place.
inline constexpr PlaceBox kNoPlaces{{1.0, 1.0, 1.0}, {0.0, 0.0, 0.0}};

/// The place at distance t is origin + t direction. In a grid whose voxels are not cubes, the length of
/// the direction in index space is not 1.
struct Ray {
  Vec3 origin, direction;
};

struct View {
  /// The rays begin at the camera's eye (parallel rays: in the plane of the eye).
  View(const Camera& camera, Resolution resolution);
  /// The view of a volume. Float64 is too coarse for places on the rays of a camera that is very far
  /// away. If the eye is more than 2^32 steps or voxels away from the volume, rays therefore begin in a
  /// plane in front of the volume. Those of a perspective camera are then parallel; it is left as it is
  /// if that would move the picture of the volume by more than a quarter of a pixel.
  /// \param box   of the volume, in index space; low > high: there is no volume
  /// \param step  distance between samples
  View(const Camera& camera, Resolution resolution, const PlaceBox& box, double step);

  Vec3 eye;  ///< where rays begin
  /// Steps of a length of 1 in the camera's space along the picture's axes.
  Vec3 right, up, forward;
  /// The inner product with a displacement is its coordinate along one of these axes.
  Vec3 ofRight, ofUp, ofForward;
  bool perspective;
  double pixel;         ///< side of a pixel in the picture's plane
  double left, top;     ///< edges of the picture in its plane
  double before = 0.0;  ///< distance from the camera's eye to where rays begin

  VoxelShape voxel;
  bool isCube;                ///< voxel.isCube()
  double longestEdge = 1.0;   ///< of a voxel
  double halfDiagonal = 0.0;  ///< half of the longest diagonal of a voxel

  /// x of the middle of a column of pixels. Columns may be fractions: 3.5 lies half-way between the
  /// middles of columns 3 and 4.
  [[nodiscard]] ESVR_HD double planeX(double column) const { return left + (column + 0.5) * pixel; }
  [[nodiscard]] ESVR_HD double planeY(double row) const { return top - (row + 0.5) * pixel; }
  /// The inverse of planeX; the result may be a fraction.
  [[nodiscard]] ESVR_HD double columnAt(double x) const { return (x - left) / pixel - 0.5; }
  [[nodiscard]] ESVR_HD double rowAt(double y) const { return (top - y) / pixel - 0.5; }

  /// Converts a direction, or a displacement from the eye, to the coordinates of the view.
  [[nodiscard]] ESVR_HD Vec3 coordinates(const Vec3& v) const {
    return {inner(ofRight, v), inner(ofUp, v), inner(ofForward, v)};
  }
  /// Length of the ray through (x, y) for one unit of depth along forward.
  [[nodiscard]] ESVR_HD double unitAlong(double x, double y) const {
    return perspective ? std::sqrt(1.0 + x * x + y * y) : 1.0;
  }
  /// Direction of the ray through (x, y), with a component of 1 along forward. Its length is
  /// unitAlong(x, y).
  [[nodiscard]] ESVR_HD Vec3 directionAt(double x, double y) const {
    return perspective ? sum(forward, sum(scaled(right, x), scaled(up, y))) : forward;
  }
  [[nodiscard]] ESVR_HD Ray ray(double column, double row) const {
    const double x = planeX(column), y = planeY(row);
    if (perspective) return {eye, scaled(directionAt(x, y), 1.0 / unitAlong(x, y))};
    return {sum(eye, sum(scaled(right, x), scaled(up, y))), forward};
  }
  /// A displacement of the index space in the camera's space.
  [[nodiscard]] ESVR_HD Vec3 inCameraSpace(const Vec3& v) const {
    if (isCube) return v;
    return sum(scaled(voxel.edges[0], v[0]),
               sum(scaled(voxel.edges[1], v[1]), scaled(voxel.edges[2], v[2])));
  }

 private:
  void setVoxel(const VoxelShape& shape);
  void beginAt(const Vec3& place);
};

}  // namespace esvr
