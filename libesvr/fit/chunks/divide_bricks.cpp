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
  Division(const SparseVolume& volume, std::size_t maxBricks)
      : volume_(volume), maxBricks_(maxBricks) {}

  void divide(const Box& box, std::vector<std::uint32_t> bricks) {
    BrickChunk chunk{box, boundsOf(volume_, bricks), {}, 0};
    if (bricks.size() > std::max<std::size_t>(maxBricks_, 1))
      return divideAt(planeFor(chunk.bounds, bricks), box, bricks);
    for (const std::uint32_t b : bricks)
      chunk.activeVoxels += std::uint64_t(volume_.active[b].count());
    chunk.bricks = std::move(bricks);
    chunks_.push_back(std::move(chunk));
  }

  std::vector<BrickChunk> take() { return std::move(chunks_); }

 private:
  /// The plane that halves two or more bricks across the longest side of their bounds.
  [[nodiscard]] DividingPlane planeFor(const Box& bounds,
                                       std::span<const std::uint32_t> bricks) const {
    DividingPlane plane;
    for (const auto axis : kAxes)
      if (lengthOf(bounds, axis) > lengthOf(bounds, plane.axis)) plane.axis = axis;
    std::vector<std::int32_t> places;
    for (const std::uint32_t b : bricks) places.push_back(volume_.bricks[b].*plane.axis);
    const auto middle = places.begin() + std::ptrdiff_t(places.size() / 2);
    std::nth_element(places.begin(), middle, places.end());
    const std::int32_t median = *middle;
    const auto below = std::ranges::count_if(places, [&](auto place) { return place < median; });
    const auto upTo = std::ranges::count_if(places, [&](auto place) { return place <= median; });
    // Bricks at the median lie on the side that makes both sides more equal.
    const auto all = std::ptrdiff_t(places.size());
    const bool isFirstAbove = below > 0 && (all - 2 * below <= 2 * upTo - all || upTo == all);
    plane.position = isFirstAbove ? median : median + 1;
    return plane;
  }

  static std::int64_t lengthOf(const Box& bounds, std::int32_t Coord::*axis) {
    return std::int64_t{bounds.max.*axis} - bounds.min.*axis;
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
  std::size_t maxBricks_;
  std::vector<BrickChunk> chunks_;
};

}  // namespace

std::vector<BrickChunk> divideBricks(const SparseVolume& volume, std::size_t maxBricks) {
  std::vector<std::uint32_t> all(volume.brickCount());
  std::iota(all.begin(), all.end(), 0u);
  Division division(volume, maxBricks);
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
