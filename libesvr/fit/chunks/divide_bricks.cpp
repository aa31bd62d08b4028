#include "fit/chunks/divide_bricks.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "core/axes.h"

namespace esvr {
namespace {

Box boundsOf(const SparseVolume& volume, std::span<const std::uint32_t> bricks) {
  Box bounds;
  for (const std::uint32_t b : bricks) bounds.expand(volume.bricks[b]);
  return bounds;
}

/// A plane across an axis: bricks below `position` lie on its lower side.
struct DividingPlane {
  std::int32_t Coord::*axis = &Coord::x;
  std::int32_t position = 0;
};

class Division {
 public:
  Division(const SparseVolume& volume, std::uint64_t maxVoxels)
      : volume_(volume), maxVoxels_(maxVoxels) {}

  void divide(const Box& box, std::vector<std::uint32_t> bricks) {
    BrickChunk chunk{box, boundsOf(volume_, bricks), {}, 0};
    for (const std::uint32_t b : bricks) chunk.activeVoxels += activeIn(b);
    if (chunk.activeVoxels > maxVoxels_ && bricks.size() > 1)
      return divideAt(planeFor(chunk, bricks), box, bricks);
    chunk.bricks = std::move(bricks);
    chunks_.push_back(std::move(chunk));
  }

  std::vector<BrickChunk> take() { return std::move(chunks_); }

 private:
  [[nodiscard]] std::uint64_t activeIn(std::uint32_t b) const {
    return std::uint64_t(volume_.active[b].count());
  }

  /// The plane that halves the active voxels across the longest side, with bricks on both sides.
  [[nodiscard]] DividingPlane planeFor(const BrickChunk& chunk,
                                       std::span<const std::uint32_t> bricks) const {
    const Box& bounds = chunk.bounds;
    DividingPlane plane;
    for (const auto axis : kAxes)
      if (bounds.max.*axis - bounds.min.*axis > bounds.max.*plane.axis - bounds.min.*plane.axis)
        plane.axis = axis;
    std::vector<std::uint64_t> active(std::size_t(bounds.max.*plane.axis - bounds.min.*plane.axis) +
                                      1);
    for (const std::uint32_t b : bricks)
      active[std::size_t(volume_.bricks[b].*plane.axis - bounds.min.*plane.axis)] += activeIn(b);
    std::uint64_t below = 0;
    plane.position = bounds.min.*plane.axis;
    do below += active[std::size_t(plane.position++ - bounds.min.*plane.axis)];
    while (2 * below < chunk.activeVoxels && plane.position < bounds.max.*plane.axis);
    return plane;
  }

  void divideAt(const DividingPlane& plane, const Box& box, std::span<const std::uint32_t> bricks) {
    std::vector<std::uint32_t> low, high;
    for (const std::uint32_t b : bricks)
      (volume_.bricks[b].*plane.axis < plane.position ? low : high).push_back(b);
    Box lowBox = box, highBox = box;
    lowBox.max.*plane.axis = plane.position - 1;
    highBox.min.*plane.axis = plane.position;
    divide(lowBox, std::move(low));
    divide(highBox, std::move(high));
  }

  const SparseVolume& volume_;
  std::uint64_t maxVoxels_;
  std::vector<BrickChunk> chunks_;
};

}  // namespace

std::vector<BrickChunk> divideBricks(const SparseVolume& volume, std::uint64_t maxVoxels) {
  std::vector<std::uint32_t> all(volume.brickCount());
  std::iota(all.begin(), all.end(), 0u);
  Division division(volume, maxVoxels);
  division.divide(Box::whole(), std::move(all));
  return division.take();
}

Box dilated(const Box& box, int bricks) {
  const auto moved = [](std::int32_t coordinate, std::int64_t by) {
    return std::int32_t(std::clamp<std::int64_t>(coordinate + by, Box::kMin, Box::kMax));
  };
  Box result;
  for (const auto axis : kAxes) {
    result.min.*axis = moved(box.min.*axis, -bricks);
    result.max.*axis = moved(box.max.*axis, bricks);
  }
  return result;
}

}  // namespace esvr
