#pragma once
/// The geometry of a picture, for host and device: vectors, the coordinates of a camera, the rays
/// of its pixels, and which rays and which samples of them may meet a box or a brick of cells.

#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include "core/geometry.h"
#include "esvr/camera.h"
#include "esvr/ellipsoids.h"
#include "esvr/render.h"
#include "esvr/volume.h"

namespace esvr {

// Numbers and vectors.

ESVR_HD inline double lesser(double a, double b) { return b < a ? b : a; }
ESVR_HD inline double greater(double a, double b) { return a < b ? b : a; }
ESVR_HD inline double clampedTo(double v, double low, double high) {
  return greater(low, lesser(v, high));
}

ESVR_HD inline Vec3 pointOf(const Coord& c) { return {double(c.x), double(c.y), double(c.z)}; }
ESVR_HD inline Vec3 sum(const Vec3& a, const Vec3& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
ESVR_HD inline Vec3 difference(const Vec3& a, const Vec3& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
ESVR_HD inline Vec3 scaled(const Vec3& a, double s) { return {a[0] * s, a[1] * s, a[2] * s}; }
/// The dot product. field/line_form.h already has a function `dot`.
ESVR_HD inline double inner(const Vec3& a, const Vec3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
ESVR_HD inline Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
/// The length, also if its square overflows.
inline double length(const Vec3& a) { return std::hypot(a[0], a[1], a[2]); }
inline Vec3 unit(const Vec3& a) { return scaled(a, 1.0 / length(a)); }
inline bool parallel(const Vec3& a, const Vec3& b) {
  constexpr double kSine = 1e-6;  // sine of the angle below which vectors count as parallel
  return length(cross(a, b)) <= kSine * length(a) * length(b);
}
inline double radians(double degrees) { return degrees * std::numbers::pi / 180.0; }

// The view and its rays.

/// A box without a place.
inline constexpr PlaceBox kNoPlaces{{1.0, 1.0, 1.0}, {0.0, 0.0, 0.0}};

/// The place at distance t is origin + t direction. In a grid whose voxels are not cubes, the
/// length of the direction in index space is not 1.
struct Ray {
  Vec3 origin, direction;
};
/// The coordinates of a camera: right, up and forward, from the place where rays begin. Points of
/// the picture have coordinates (x, y) in the picture's plane: for a perspective camera it lies at
/// a distance of 1 in front of the eye, and for parallel rays x and y are lengths. Lengths are
/// those of the camera's space (esvr/camera.h), and places are those of the grid's index space, so
/// that rays are marched through voxels. The struct holds plain numbers, so that it can be copied
/// to a device.
struct View {
  /// The rays begin at the camera's eye (parallel rays: in the plane of the eye).
  View(const Camera& camera, Resolution resolution);
  /// The view of a volume. Float64 is too coarse for places on the rays of a camera that is very
  /// far away. If the eye is more than 2^32 steps or voxels away from the volume, rays therefore
  /// begin in a plane in front of the volume. Those of a perspective camera are then parallel; it
  /// is left as it is if that would move the picture of the volume by more than a quarter of a
  /// pixel.
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

/// The range, over the rays of a rectangle of pixels, of the length of ray for one unit of depth
/// along forward.
struct UnitRange {
  double min, max;
};
ESVR_HD inline UnitRange unitRange(const View& view, int firstColumn, int lastColumn, int firstRow,
                                   int lastRow) {
  if (!view.perspective) return {1.0, 1.0};
  const double x0 = view.planeX(firstColumn), x1 = view.planeX(lastColumn);
  const double y0 = view.planeY(lastRow), y1 = view.planeY(firstRow);
  return {view.unitAlong(clampedTo(0.0, x0, x1), clampedTo(0.0, y0, y1)),
          view.unitAlong(greater(-x0, x1), greater(-y0, y1))};
}

// The part of a ray in a box, and its samples. Sample n of a ray lies n steps from its origin.

/// An interval of distances along a ray; empty if begin > end.
struct RayInterval {
  double begin, end;
};

/// The part of a ray between two planes perpendicular to an axis.
ESVR_HD inline RayInterval slab(double origin, double direction, double low, double high) {
  constexpr double kAll = std::numeric_limits<double>::infinity();
  if (direction == 0.0)
    return origin >= low && origin <= high ? RayInterval{-kAll, kAll} : RayInterval{kAll, -kAll};
  const double a = (low - origin) / direction, b = (high - origin) / direction;
  return a < b ? RayInterval{a, b} : RayInterval{b, a};
}

/// The part of a ray that lies in a box and not behind the ray's origin.
ESVR_HD inline RayInterval within(const Ray& ray, const PlaceBox& box) {
  RayInterval t{0.0, std::numeric_limits<double>::infinity()};
  for (int a = 0; a < 3; ++a) {
    const RayInterval s = slab(ray.origin[a], ray.direction[a], box.low[a], box.high[a]);
    t.begin = s.begin > t.begin ? s.begin : t.begin;
    t.end = s.end < t.end ? s.end : t.end;
  }
  return t;
}

/// The largest number of samples that a ray may have in a volume. checkRayLength() (picture.h)
/// refuses longer ones, and no march visits more samples, whatever rounding makes of a ray's ends.
inline constexpr std::int64_t kMostRaySamples = std::int64_t{1} << 24;

/// A range of a ray's samples.
struct SampleRange {
  double first, last;

  ESVR_HD static SampleRange all() { return {0.0, std::numeric_limits<double>::infinity()}; }

  [[nodiscard]] ESVR_HD bool has(double number) const { return number >= first && number <= last; }
  [[nodiscard]] ESVR_HD SampleRange both(const SampleRange& other) const {
    return {other.first > first ? other.first : first, other.last < last ? other.last : last};
  }
  /// The number of samples from the first one to a later one, at most kMostRaySamples.
  [[nodiscard]] ESVR_HD int countTo(double number) const {
    const double count = number - first;
    if (!(count > 0.0)) return 0;
    return count < double(kMostRaySamples) ? int(count) : int(kMostRaySamples);
  }
};

ESVR_HD inline SampleRange samplesIn(const RayInterval& t, double step) {
  return {std::ceil(t.begin / step), std::floor(t.end / step)};
}

/// An optional clip box. If it is not given, all places are inside.
struct ClipBox {
  PlaceBox box;
  bool given;
};
[[nodiscard]] inline ClipBox clipOf(const RenderOptions& options) {
  return {options.clip.value_or(PlaceBox{}), options.clip.has_value()};
}
ESVR_HD inline SampleRange samplesIn(const Ray& ray, const ClipBox& clip, double step) {
  return clip.given ? samplesIn(within(ray, clip.box), step) : SampleRange::all();
}

/// Consecutive samples of a ray make bins, counted from its origin. Rays are marched, and sums of
/// ellipsoids are drawn, from bin to bin.
inline constexpr int kBinSamples = 32;
struct BinRange {
  std::int64_t first, last;  ///< empty if last < first
};
/// The bins of the samples between two depths along forward, on all rays of a range. Depths are at
/// least 0.
ESVR_HD inline BinRange binsOf(double nearest, double farthest, const UnitRange& unit,
                               double step) {
  constexpr double kRounding = 1e-6;   // bins; a bound may lie exactly on a sample
  constexpr double kLastBin = 0x1p52;  // keeps the conversion to integers within their range
  const double binLength = step * kBinSamples;
  const double first = std::floor(nearest * unit.min / binLength - kRounding);
  const double last = std::floor(farthest * unit.max / binLength + kRounding);
  return {std::int64_t(clampedTo(first, 0.0, kLastBin)),
          std::int64_t(clampedTo(last, -1.0, kLastBin))};
}

// The part of a picture that a brick of cells may cover, and the samples that may lie in it.

/// Covers of corners are combined to that of their brick.
struct BrickCover {
  float firstColumn, lastColumn, firstRow, lastRow;  ///< pixels
  int first, last;                                   ///< samples, counted from firstSample
};

/// The rays of a picture and their samples. Sample n lies (firstSample + n) steps from the eye.
struct CoverView {
  View view;  ///< in the frame of the bricks' places
  Resolution resolution;
  double step, firstSample;

  /// \param along  distance from the eye; orthographic: from its plane
  [[nodiscard]] ESVR_HD int sampleAt(double along) const {
    constexpr double kMost = 1e9;  // beyond all samples of the volume
    const double n = std::floor(along / step - firstSample);
    return int(n < -kMost ? -kMost : (n > kMost ? kMost : n));
  }
};

/// The place of a corner of a brick. \param brick  place in bricks, in the frame of the view
ESVR_HD inline Vec3 cornerOf(const Coord& brick, int corner) {
  const Coord step = stepToCorner(corner);
  return {double((brick.x + step.x) * kBrickSide), double((brick.y + step.y) * kBrickSide),
          double((brick.z + step.z) * kBrickSide)};
}

/// A distance from the eye that is at most that of the brick.
ESVR_HD inline double distanceTo(const Coord& brick, const View& view) {
  const Vec3 low = cornerOf(brick, 0), high = cornerOf(brick, kCellCorners - 1), &eye = view.eye;
  if (!view.isCube) {
    const Vec3 middle = view.coordinates(difference(scaled(sum(low, high), 0.5), eye));
    return std::sqrt(inner(middle, middle)) - kBrickSide * view.halfDiagonal;
  }
  double squares = 0.0;
  for (int a = 0; a < 3; ++a) {
    const double below = low[a] - eye[a], above = eye[a] - high[a];
    const double away = below > above ? below : above;
    if (away > 0.0) squares += away * away;
  }
  return std::sqrt(squares);
}

/// The cover of one corner of a brick. If the corner lies behind the eye, it cannot be projected,
/// and the result is the whole picture.
ESVR_HD inline BrickCover coverOfCorner(const CoverView& v, const Coord& brick, int corner) {
  const Vec3 place = cornerOf(brick, corner);
  const Vec3 seen = v.view.coordinates(difference(place, v.view.eye));
  const int sample = v.sampleAt(v.view.perspective ? std::sqrt(inner(seen, seen)) : seen[2]);
  constexpr float kAll = 1e9f;
  if (v.view.perspective && !(seen[2] > 1e-3))
    return {-kAll, kAll, -kAll, kAll, sample, sample + 1};
  const double scale = v.view.perspective ? 1.0 / seen[2] : 1.0;
  const auto column = float(v.view.columnAt(seen[0] * scale));
  const auto row = float(v.view.rowAt(seen[1] * scale));
  return {column, column, row, row, sample, sample + 1};
}

/// The first sample that may lie in a brick, in a perspective view. The brick may be nearer than
/// its corners.
ESVR_HD inline int firstSampleOf(const CoverView& v, const Coord& brick) {
  return v.sampleAt(distanceTo(brick, v.view));
}

/// The tiles of a picture that a cover meets; none if `columns` or `rows` is not positive.
struct CoveredTiles {
  int firstColumn, firstRow, columns, rows;
};
/// \param side  side of a tile in pixels
ESVR_HD inline CoveredTiles tilesOf(const CoverView& v, const BrickCover& c, int side) {
  const Resolution r = v.resolution;
  constexpr float kHalf = 0.5f;  // a pixel reaches half a pixel to each side of its middle
  const bool seen = c.last >= v.sampleAt(0.0) && c.lastColumn >= -kHalf && c.lastRow >= -kHalf &&
                    c.firstColumn <= float(r.width) && c.firstRow <= float(r.height);
  if (!seen) return {0, 0, 0, 0};
  const auto tile = [side](float pixel, int count) {
    const float last = float(count - 1), inside = pixel > 0.0f ? pixel : 0.0f;
    return int(std::floor(inside < last ? inside : last)) / side;
  };
  const int column = tile(c.firstColumn - kHalf, r.width), row = tile(c.firstRow - kHalf, r.height);
  return {column, row, tile(c.lastColumn + kHalf, r.width) - column + 1,
          tile(c.lastRow + kHalf, r.height) - row + 1};
}

}  // namespace esvr
