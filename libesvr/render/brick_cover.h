#pragma once
/// The part of a picture that a brick of cells may cover, and the samples that may lie in it. The
/// code is compiled for host and device.

#include "core/cell_corner.h"
#include "esvr/sparse_volume.h"
#include "render/view.h"

namespace esvr {

/// Covers of corners are combined to that of their brick.
struct BrickCover {
  float firstColumn, lastColumn, firstRow, lastRow;  ///< pixels
  int first, last;                                   ///< samples, counted from firstSample
};

/// The rays of a picture and their samples. Sample n lies (firstSample + n) steps from the eye.
struct CoverView {
  View view;
  Resolution resolution;
  double step, firstSample;

  /// \param along  distance from the eye; orthographic: from its plane
  [[nodiscard]] ESVR_HD int sampleAt(double along) const {
    constexpr double kMost = 1e9;  // beyond all samples of the volume
    const double n = std::floor(along / step - firstSample);
    return int(n < -kMost ? -kMost : (n > kMost ? kMost : n));
  }
};

namespace brick_cover {

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

}  // namespace brick_cover

/// The cover of one corner of a brick. If the corner lies behind the eye, it cannot be projected,
/// and the result is the whole picture.
/// \param brick  place in bricks, in the frame of the view
ESVR_HD inline BrickCover coverOfCorner(const CoverView& v, const Coord& brick, int corner) {
  const Vec3 place = brick_cover::cornerOf(brick, corner);
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

/// The first sample that may lie in a brick, in a perspective view. The brick may be nearer than its
/// corners.
ESVR_HD inline int firstSampleOf(const CoverView& v, const Coord& brick) {
  return v.sampleAt(brick_cover::distanceTo(brick, v.view));
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
