#pragma once
/// The voxels that the samples of neighbouring rays are interpolated from: slabs across the axis
/// that the rays run along most, and in each slab a rectangle of rows and columns that goes with
/// the rays. So there are about as many as the rays have room for between them, whatever their
/// direction. For host and device.

#include <cmath>
#include <cstdint>

#include "render/seen_ellipsoid.h"
#include "render/view.h"
#include "render/whole.h"
#include "render/window_form.h"

/// Before loops over few corners. Windows are planned by one thread of a block: unrolled, they
/// would take registers from all the others.
#if defined(__CUDA_ARCH__)
#define ESVR_ROLLED _Pragma("unroll 1")
#else
#define ESVR_ROLLED
#endif

namespace esvr {

/// Pixels of a picture, first and last.
struct PixelRectangle {
  int firstColumn, lastColumn, firstRow, lastRow;
};

/// A ray at the corner of a rectangle of pixels: at which slab it is at a depth along forward; at
/// which row and column at slab s.
struct CornerRay {
  double slab, slabOfDepth;
  double row, rowOfSlab;
  double column, columnOfSlab;
};

/// The rays of a rectangle of pixels: those at its corners hold the others between them.
struct RayBundle {
  static constexpr int kCorners = 4;

  WindowAxes axes;
  CornerRay corners[kCorners];
  UnitRange unit;  ///< the rays' range
  bool together;   ///< false: their directions are too different for one window
};

/// Depths along forward.
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

/// Voxels, for rounding: samples are found in float32, relative to the window.
inline constexpr double kSlack = 1e-3;
/// The share of a ray's length that it must go along the slabs' axis. A ray that is taken alone
/// goes 0.57.
inline constexpr double kMinAlong = 0.3;

ESVR_HD inline int maxAlong(const Vec3& d) {
  const double x = std::abs(d[0]), y = std::abs(d[1]), z = std::abs(d[2]);
  return x >= y && x >= z ? 0 : (y >= z ? 1 : 2);
}

/// Rounds down, within the integers. No voxel lies at the ends, so any bound there will do.
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

/// The extent of rays between the slabs before and behind: the planes of voxels at a slab serve
/// both.
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

/// How many voxels hold all cells of an extent, wherever it begins.
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

/// The depths of some samples on any ray of a bundle. \param step  voxels
ESVR_HD inline DepthRange depthsOf(const RayBundle& b, double firstSample, double lastSample,
                                   double step) {
  return {firstSample * step / b.unit.max, lastSample * step / b.unit.min};
}

/// How large a window may be.
struct WindowLimits {
  int slabs, voxels;
};

/// The window for the samples of a bundle within some depths. \return false where it is too large
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

/// The place of a slab of a window, in voxels from its first slab's first voxel, and where it is
/// kept: voxel (row, column) of it at start + row * columns + column.
struct WindowSlab {
  std::int32_t row, column, start;
};
/// The window's first voxel, along slabs, rows and columns.
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

/// A place in a window, in voxels from its first.
struct WindowPlace {
  float slab, row, column;
};

namespace voxel_window {
ESVR_HD inline float between(float a, float b, float s) { return a + s * (b - a); }

/// In the plane of a slab. \param v  the voxel before the place
ESVR_HD inline float inPlane(const float* v, int columns, float row, float column) {
  return between(between(v[0], v[1], column), between(v[columns], v[columns + 1], column), row);
}
}  // namespace voxel_window

/// \param values  of the window
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
