#pragma once
/// What all generators have: their options, and the conversion of a shape to a sparse volume. An
/// octree is searched for bricks with active voxels, which are then filled. Time and memory are
/// proportional to the active voxels, not to the bounding box.

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "esvr/device.h"
#include "esvr/error.h"
#include "esvr/volume.h"

namespace esvr::samples {

/// A point or direction in float64.
struct Vec3 {
  double x = 0.0, y = 0.0, z = 0.0;

  friend constexpr Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend constexpr Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend constexpr Vec3 operator*(Vec3 a, double s) { return {a.x * s, a.y * s, a.z * s}; }
};

constexpr double dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
constexpr Vec3 minVec(Vec3 a, Vec3 b) {
  return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)};
}
constexpr Vec3 maxVec(Vec3 a, Vec3 b) {
  return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)};
}
inline double length(Vec3 v) { return std::sqrt(dot(v, v)); }
inline Vec3 normalised(Vec3 v) { return v * (1.0 / length(v)); }

/// Limits of a generation.
struct Limits {
  std::uint64_t maxBricks = std::numeric_limits<std::uint64_t>::max();  ///< then DeviceError
  const CancelToken* cancel = nullptr;                                  ///< then Cancelled
};

struct SampleOptions {
  int resolution = 128;  ///< voxels along the longest side of what the sample shows
  std::uint64_t seed = 1;
  int frame = 0;  ///< frame of a sample that moves (SampleKind::moves), from 0
  Limits limits{};
};

/// A voxel of a shape.
struct Sample {
  float value = 0.0f;
  bool active = false;
};

/// A ball in index coordinates.
struct Ball {
  Vec3 center;
  double radius = 0.0;
};

/// A scalar field over index space that can be narrowed to a part of it.
/// within(ball) is the shape for use in this ball only, or nothing if no point of it is active.
/// at(p) is the sample at index coordinates.
template <class S>
concept Shape = requires(const S& shape, const Ball& ball, Vec3 p) {
  { shape.within(ball) } -> std::same_as<std::optional<S>>;
  { shape.at(p) } -> std::same_as<Sample>;
};

struct VoxeliseOptions {
  Box box;  ///< holds all active voxels
  float background = 0.0f;
  Limits limits{};
};

/// A brick with active voxels, and the shape narrowed to it.
template <class S>
struct ShapedBrick {
  Coord brick;
  S shape;
};

namespace detail {

inline Vec3 toVec(Coord c) { return {double(c.x), double(c.y), double(c.z)}; }

/// A cube with a side of 2^level bricks at multiples of its size.
struct Cell {
  Coord place;  ///< position in units of the cell's side
  int level = 0;

  [[nodiscard]] Ball ball() const {
    const double side = double(std::int64_t{kBrickSide} << level);
    const double half = (side - 1.0) / 2.0;  // distance from the centre to the outermost voxels
    return {toVec(place) * side + Vec3{half, half, half}, std::sqrt(3.0) * half};
  }
  [[nodiscard]] Cell child(int octant) const {
    return {place * 2 + Coord{octant >> 2, (octant >> 1) & 1, octant & 1}, level - 1};
  }
};

/// The cells, at most eight, that cover a box.
inline std::vector<Cell> rootCells(const Box& box) {
  const Coord low = brickOf(box.min), high = brickOf(box.max);
  const Coord extent = high - low;
  int level = 0;
  while ((std::int64_t{1} << level) <= std::max({extent.x, extent.y, extent.z})) ++level;
  std::vector<Cell> cells;
  for (int x = low.x >> level; x <= high.x >> level; ++x)
    for (int y = low.y >> level; y <= high.y >> level; ++y)
      for (int z = low.z >> level; z <= high.z >> level; ++z) cells.push_back({{x, y, z}, level});
  return cells;
}

template <class S>
Sample sampleAt(const S& shape, Coord brick, int offset) {
  return shape.at(toVec(brick * kBrickSide + voxelLocal(offset)));
}

template <class S>
bool anyActive(const S& shape, Coord brick) {
  for (int offset = 0; offset < kBrickVoxels; ++offset)
    if (sampleAt(shape, brick, offset).active) return true;
  return false;
}

template <Shape S>
class BrickSearch {
 public:
  explicit BrickSearch(const VoxeliseOptions& options) : options_(options) {}

  /// All bricks with active voxels, in increasing order.
  std::vector<ShapedBrick<S>> run(const S& shape) {
    const auto roots = rootCells(options_.box);
    tbb::parallel_for(std::size_t{0}, roots.size(),
                      [&](std::size_t i) { descend(roots[i], shape); });
    std::vector<ShapedBrick<S>> all;
    all.reserve(found_.load());
    for (auto& part : parts_) {
      std::move(part.begin(), part.end(), std::back_inserter(all));
      part = {};
    }
    tbb::parallel_sort(all.begin(), all.end(),
                       [](const auto& a, const auto& b) { return a.brick < b.brick; });
    return all;
  }

 private:
  void descend(const Cell& cell, const S& shape) {
    if (options_.limits.cancel && options_.limits.cancel->cancelled()) throw Cancelled();
    std::optional<S> narrowed = shape.within(cell.ball());
    if (!narrowed) return;
    if (cell.level == 0) return keep(cell.place, std::move(*narrowed));
    tbb::parallel_for(0, 8, [&](int octant) { descend(cell.child(octant), *narrowed); });
  }

  void keep(Coord brick, S shape) {
    if (!anyActive(shape, brick)) return;
    if (found_.fetch_add(1) >= options_.limits.maxBricks)
      throw DeviceError("the volume has more than " + std::to_string(options_.limits.maxBricks) +
                        " bricks of 8^3 voxels, which is more than fits into memory");
    parts_.local().push_back({brick, std::move(shape)});
  }

  const VoxeliseOptions& options_;
  tbb::enumerable_thread_specific<std::vector<ShapedBrick<S>>> parts_;
  std::atomic<std::uint64_t> found_{0};
};

template <class S>
void fillBrick(const ShapedBrick<S>& from, std::span<float> values, BrickMask& active) {
  for (int offset = 0; offset < kBrickVoxels; ++offset) {
    const Sample sample = sampleAt(from.shape, from.brick, offset);
    values[std::size_t(offset)] = sample.value;
    if (sample.active) active.set(offset);
  }
}

template <class S>
Coord smallestBrick(const std::vector<ShapedBrick<S>>& bricks) {
  Coord low = bricks.front().brick;
  for (const auto& brick : bricks) low = minCoord(low, brick.brick);
  return low;
}

}  // namespace detail

/// Converts a shape. The result is bit-identical for any number of threads. The memory is that of
/// the volume (2124 bytes for each brick) and of one narrowed shape for each brick.
/// \throws Cancelled, DeviceError  as Limits says
template <Shape S>
SparseVolume voxelise(const S& shape, const VoxeliseOptions& options) {
  SparseVolume volume;
  volume.background = options.background;
  const auto found = detail::BrickSearch<S>(options).run(shape);
  if (found.empty()) return volume;

  const Coord low = detail::smallestBrick(found);
  volume.origin = low * kBrickSide;
  volume.bricks.resize(found.size());
  volume.active.resize(found.size());
  volume.values.resize(found.size() * kBrickVoxels);
  tbb::parallel_for(std::size_t{0}, found.size(), [&](std::size_t b) {
    if (options.limits.cancel && options.limits.cancel->cancelled()) throw Cancelled();
    volume.bricks[b] = found[b].brick - low;
    detail::fillBrick(found[b], volume.brickValues(b), volume.active[b]);
  });
  return volume;
}

}  // namespace esvr::samples
