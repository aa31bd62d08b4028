#pragma once
/// A voxel window holds the voxels that the samples of a bundle of neighbouring rays are
/// interpolated from. It consists of slabs, which are planes of voxels perpendicular to the axis
/// that is closest to the rays' direction. In each slab it has a rectangle of rows and columns; its
/// place follows the rays from slab to slab. A window is therefore hardly larger than the space
/// between the rays, whatever their direction. The code is compiled for host and device.

#include <cmath>
#include <cstdint>

#include "render/seen_ellipsoid.h"
#include "render/view.h"
#include "render/whole.h"
#include "render/window_form.h"

/// Keeps nvcc from unrolling a loop. A window is planned by one thread of a block, but an unrolled
/// loop would take registers from all threads.
#if defined(__CUDA_ARCH__)
#define ESVR_ROLLED _Pragma("unroll 1")
#else
#define ESVR_ROLLED
#endif

namespace esvr {

/// A rectangle of pixels; the last column and row belong to it.
struct PixelRectangle {
  int firstColumn, lastColumn, firstRow, lastRow;
};

/// A ray at the corner of a rectangle of pixels, with its position in slabs, rows and columns. At a
/// depth d along forward it is at slab coordinate slab + d slabOfDepth. At slab coordinate s it is
/// at row coordinate row + s rowOfSlab and column coordinate column + s columnOfSlab.
struct CornerRay {
  double slab, slabOfDepth;
  double row, rowOfSlab;
  double column, columnOfSlab;
};

/// The rays of a rectangle of pixels. All of them lie between the rays at its corners.
struct RayBundle {
  static constexpr int kCorners = 4;

  WindowAxes axes;
  CornerRay corners[kCorners];
  UnitRange unit;  ///< as unitRange() of the rectangle
  bool together;   ///< false if the directions of the rays differ too much for one window
};

/// A range of depths along forward.
struct DepthRange {
  double near, far;
};

struct VoxelWindow {
  WindowAxes axes;
  std::int32_t firstSlab;
  int slabs, rows, columns;

  [[nodiscard]] ESVR_HD int voxels() const { return slabs * rows * columns; }
};

namespace voxel_window {

/// Voxels by which windows are widened, because positions of samples are rounded to float32.
inline constexpr double kSlack = 1e-3;
/// Smallest |cosine| of the angle between a ray and the axis of the slabs. It is at least 0.57 for
/// a bundle of one ray, whose slabs are perpendicular to the axis that is closest to the ray.
inline constexpr double kMinAlong = 0.3;

ESVR_HD inline int maxAlong(const Vec3& d) {
  const double x = std::abs(d[0]), y = std::abs(d[1]), z = std::abs(d[2]);
  return x >= y && x >= z ? 0 : (y >= z ? 1 : 2);
}

/// Rounds down, and clamps the result to 32-bit integers. There are no voxels near their ends, so a
/// clamped result is harmless.
ESVR_HD inline std::int32_t whole(double v) {
  constexpr double kFar = double(1 << 30);
  return std::int32_t(std::floor(ellipsoid_math::clampedTo(v, -2.0 * kFar, 1.99 * kFar)));
}

ESVR_HD inline Vec3 originOf(const View& view, double x, double y) {
  return view.perspective ? view.eye
                          : sum(view.eye, sum(scaled(view.right, x), scaled(view.up, y)));
}

ESVR_HD inline CornerRay cornerRay(const WindowAxes& axes, const Vec3& origin, const Vec3& d) {
  const double row = d[axes.row] / d[axes.slab], column = d[axes.column] / d[axes.slab];
  return {origin[axes.slab],
          d[axes.slab],
          origin[axes.row] - origin[axes.slab] * row,
          row,
          origin[axes.column] - origin[axes.slab] * column,
          column};
}

/// An interval of coordinates. rowsAt() and columnsAt() return what the rays cover from one slab
/// before to one slab behind, because the voxels of a slab serve the samples on both sides.
struct Extent {
  double low, high;
};
ESVR_HD inline Extent rowsAt(const RayBundle& b, double slab) {
  Extent e{1e300, -1e300};
  ESVR_ROLLED for (const CornerRay& c : b.corners) {
    const double at = c.row + slab * c.rowOfSlab, turn = std::abs(c.rowOfSlab);
    e.low = ellipsoid_math::lesser(e.low, at - turn);
    e.high = ellipsoid_math::greater(e.high, at + turn);
  }
  return e;
}
ESVR_HD inline Extent columnsAt(const RayBundle& b, double slab) {
  Extent e{1e300, -1e300};
  ESVR_ROLLED for (const CornerRay& c : b.corners) {
    const double at = c.column + slab * c.columnOfSlab, turn = std::abs(c.columnOfSlab);
    e.low = ellipsoid_math::lesser(e.low, at - turn);
    e.high = ellipsoid_math::greater(e.high, at + turn);
  }
  return e;
}
ESVR_HD inline Extent slabsOf(const RayBundle& b, const DepthRange& depth) {
  Extent e{1e300, -1e300};
  ESVR_ROLLED for (const CornerRay& c : b.corners) {
    const double near = c.slab + depth.near * c.slabOfDepth;
    const double far = c.slab + depth.far * c.slabOfDepth;
    e.low = ellipsoid_math::lesser(e.low, ellipsoid_math::lesser(near, far));
    e.high = ellipsoid_math::greater(e.high, ellipsoid_math::greater(near, far));
  }
  return e;
}

/// Number of voxels that suffices for the cells of both extents, wherever between two voxels they
/// begin.
ESVR_HD inline double voxelsAcross(const Extent& at, const Extent& orAt) {
  const double width = ellipsoid_math::greater(at.high - at.low, orAt.high - orAt.low);
  return std::floor(width + 2.0 * kSlack) + 3.0;
}

}  // namespace voxel_window

ESVR_HD inline RayBundle bundleOf(const View& view, const PixelRectangle& p) {
  using namespace voxel_window;
  const double middleX = 0.5 * (view.planeX(p.firstColumn) + view.planeX(p.lastColumn));
  const double middleY = 0.5 * (view.planeY(p.firstRow) + view.planeY(p.lastRow));
  RayBundle b;
  b.axes = axesOfSlabs(maxAlong(view.directionAt(middleX, middleY)));
  b.unit = unitRange(view, p.firstColumn, p.lastColumn, p.firstRow, p.lastRow);
  b.together = true;
  double side = 0.0;
  ESVR_ROLLED for (int c = 0; c < RayBundle::kCorners; ++c) {
    const double x = view.planeX(c % 2 == 0 ? p.firstColumn : p.lastColumn);
    const double y = view.planeY(c < 2 ? p.firstRow : p.lastRow);
    const Vec3 d = view.directionAt(x, y);
    const double along = d[b.axes.slab];
    if (c == 0) side = along;
    b.together =
        b.together && along * side > 0.0 && std::abs(along) >= kMinAlong * view.unitAlong(x, y);
    b.corners[c] = cornerRay(b.axes, originOf(view, x, y), d);
  }
  return b;
}

/// A range that contains the depths of the samples on every ray of a bundle.
/// \param step  distance between samples, voxels
ESVR_HD inline DepthRange depthsOf(const RayBundle& b, double firstSample, double lastSample,
                                   double step) {
  return {firstSample * step / b.unit.max, lastSample * step / b.unit.min};
}

/// The limits on the size of a window.
struct WindowLimits {
  int slabs, voxels;
};

/// Finds the window for the samples of a bundle in a range of depths.
/// \return false if the window is too large
ESVR_HD inline bool windowFor(const RayBundle& b, const DepthRange& depth,
                              const WindowLimits& limits, VoxelWindow& w) {
  using namespace voxel_window;
  if (!b.together) return false;
  const Extent slabs = slabsOf(b, depth);
  const double first = std::floor(slabs.low - kSlack), last = std::floor(slabs.high + kSlack) + 1.0;
  const double count = last - first + 1.0;
  const double rows = voxelsAcross(rowsAt(b, first), rowsAt(b, last));
  const double columns = voxelsAcross(columnsAt(b, first), columnsAt(b, last));
  if (!(count <= limits.slabs && count * rows * columns <= limits.voxels)) return false;
  w = {b.axes, whole(first), int(count), int(rows), int(columns)};
  return true;
}

/// The first row and column of a window at one of its slabs.
ESVR_HD inline std::int32_t firstRowAt(const RayBundle& b, double slab) {
  return voxel_window::whole(voxel_window::rowsAt(b, slab).low - voxel_window::kSlack);
}
ESVR_HD inline std::int32_t firstColumnAt(const RayBundle& b, double slab) {
  return voxel_window::whole(voxel_window::columnsAt(b, slab).low - voxel_window::kSlack);
}

/// The first row and column of a slab, relative to the window's origin, and its place in memory:
/// the voxel at (row, column), relative to the origin too, is at start + row * columns + column.
struct WindowSlab {
  std::int32_t row, column, start;
};
/// The first voxel of the first slab of a window.
struct WindowOrigin {
  std::int32_t slab, row, column;
};
ESVR_HD inline WindowOrigin originOf(const RayBundle& b, const VoxelWindow& w) {
  return {w.firstSlab, firstRowAt(b, w.firstSlab), firstColumnAt(b, w.firstSlab)};
}
ESVR_HD inline WindowSlab slabOf(const RayBundle& b, const VoxelWindow& w,
                                 const WindowOrigin& origin, int slab) {
  const double at = double(w.firstSlab) + slab;
  const std::int32_t row = firstRowAt(b, at) - origin.row;
  const std::int32_t column = firstColumnAt(b, at) - origin.column;
  return {row, column, slab * w.rows * w.columns - row * w.columns - column};
}

/// A place relative to the window's origin, in voxels.
struct WindowPlace {
  float slab, row, column;
};

namespace voxel_window {
ESVR_HD inline float between(float a, float b, float s) { return a + s * (b - a); }

/// Bilinear interpolation in the plane of a slab.
/// \param v            the voxel at or below the place
/// \param row, column  position of the place from that voxel, 0 to 1
ESVR_HD inline float inPlane(const float* v, int columns, float row, float column) {
  return between(between(v[0], v[1], column), between(v[columns], v[columns + 1], column), row);
}
}  // namespace voxel_window

/// Trilinear interpolation in a window. \param values  voxels of the window
ESVR_HD inline float interpolate(const float* values, const WindowSlab* slabs, int columns,
                                 const WindowPlace& p) {
  using namespace voxel_window;
  const WholePart s = wholePart(p.slab), r = wholePart(p.row), c = wholePart(p.column);
  const int offset = r.whole * columns + c.whole;
  const float low = inPlane(values + slabs[s.whole].start + offset, columns, r.left, c.left);
  const float high = inPlane(values + slabs[s.whole + 1].start + offset, columns, r.left, c.left);
  return between(low, high, s.left);
}

}  // namespace esvr
