#include "esvr/packed_grid.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "esvr/error.h"
#include "esvr/memory_limit.h"

namespace esvr {
namespace {

/// What a brick takes besides its values until the grid is written: its entry, and OpenVDB's leaf
/// without voxels.
constexpr std::uint64_t kBytesPerPackedBrick = sizeof(PackedBrick) + 160;

/// Calls visit(offset) for the active voxels of a brick in their order.
template <class Visit>
void forEachActive(const BrickMask& mask, Visit&& visit) {
  for (int x = 0; x < kBrickSide; ++x)
    for (std::uint64_t word = mask.words[std::size_t(x)]; word; word &= word - 1)
      visit(x * 64 + std::countr_zero(word));
}

/// A smallest active value, or the value that is not active, in the type of the source, so that the
/// inner loop compares without a conversion.
template <class Source>
class ActivityTest {
 public:
  ActivityTest(const std::optional<double>& threshold, double background) {
    if (threshold) {
      isThreshold_ = true;
      setThreshold(*threshold);
    } else {
      // No value of an integer type equals a background between its values.
      limit_ = inRange(background) ? Source(background) : Source{};
      constant_ = !inRange(background) || double(limit_) != background;
      constantIs_ = true;
    }
  }

  [[nodiscard]] bool operator()(Source value) const {
    if (constant_) return constantIs_;
    return isThreshold_ ? value >= limit_ : value != limit_;
  }

 private:
  using Limits = std::numeric_limits<Source>;

  static bool inRange(double value) {
    // The largest integer of 64 bits is not a double; the double next to it is out of range.
    constexpr bool kRounded = std::is_integral_v<Source> && sizeof(Source) == sizeof(std::int64_t);
    const bool below = kRounded ? value < double(Limits::max()) : value <= double(Limits::max());
    return value >= double(Limits::lowest()) && below;
  }

  void setThreshold(double threshold) {
    if constexpr (std::is_integral_v<Source>) threshold = std::ceil(threshold);
    if (inRange(threshold)) {
      limit_ = Source(threshold);
      // A float below the threshold must not be rounded up to it.
      if constexpr (std::is_floating_point_v<Source>)
        if (double(limit_) < threshold) limit_ = std::nextafter(limit_, Limits::infinity());
      return;
    }
    constant_ = true;
    constantIs_ = threshold < double(Limits::lowest());
  }

  Source limit_{};
  bool isThreshold_ = false, constant_ = false, constantIs_ = false;
};

/// The axes from the one with the largest step in memory to the one with the smallest.
std::array<int, 3> axesByStride(const std::array<std::ptrdiff_t, 3>& strides) {
  std::array<int, 3> axes{0, 1, 2};
  std::ranges::stable_sort(axes, [&](int a, int b) {
    return std::abs(strides[std::size_t(a)]) > std::abs(strides[std::size_t(b)]);
  });
  return axes;
}

std::array<std::int32_t, 3> arrayOf(Coord c) { return {c.x, c.y, c.z}; }
Coord coordOf(const std::array<std::int32_t, 3>& a) { return {a[0], a[1], a[2]}; }

std::ptrdiff_t offsetOf(const std::array<std::ptrdiff_t, 3>& strides, Coord voxel) {
  return strides[0] * voxel.x + strides[1] * voxel.y + strides[2] * voxel.z;
}

/// The mask of the voxels of a brick that are active.
/// \param local  the brick's corner in the box
/// \param test   takes the offset of a voxel in the array
template <class Test>
BrickMask maskOf(Coord local, Coord size, const std::array<std::ptrdiff_t, 3>& strides,
                 const Test& test) {
  BrickMask mask;
  const auto axes = axesByStride(strides);
  const auto begin = arrayOf(local);
  const auto end = arrayOf(minCoord(local + Coord{kBrickSide, kBrickSide, kBrickSide}, size));
  constexpr std::array<int, 3> kShift{6, 3, 0};  // of a coordinate in voxelOffset
  const auto step = [&](int a) { return strides[std::size_t(axes[std::size_t(a)])]; };
  const auto shift = [&](int a) { return kShift[std::size_t(axes[std::size_t(a)])]; };
  const auto count = [&](int a) {
    const auto axis = std::size_t(axes[std::size_t(a)]);
    return end[axis] - begin[axis];
  };
  const std::ptrdiff_t first = offsetOf(strides, local);
  for (int i = 0; i < count(0); ++i)
    for (int j = 0; j < count(1); ++j)
      for (int k = 0; k < count(2); ++k) {
        const int offset = (i << shift(0)) | (j << shift(1)) | (k << shift(2));
        const bool on = test(first + i * step(0) + j * step(1) + k * step(2));
        mask.words[std::size_t(offset >> 6)] |= std::uint64_t(on) << (offset & 63);
      }
  return mask;
}

template <class T, class Source>
BrickMask activeIn(std::span<const ImageBox<Source>> boxes, Coord local, const T& background,
                   const PackingRule& rule) {
  const ImageBox<Source>& box = boxes.front();
  if (box.active)
    return maskOf(local, box.size, box.activeStrides,
                  [&](std::ptrdiff_t at) { return box.active[at]; });
  BrickMask mask;
  for (std::size_t c = 0; c < boxes.size(); ++c) {
    double inactive = 0.0;
    if constexpr (std::is_same_v<T, PackedVector>)
      inactive = double(background[c]);
    else
      inactive = double(background);
    const ActivityTest<Source> test(rule.threshold, inactive);
    const BrickMask more =
        maskOf(local, boxes[c].size, boxes[c].strides,
               [&, voxels = boxes[c].voxels](std::ptrdiff_t at) { return test(voxels[at]); });
    for (std::size_t w = 0; w < mask.words.size(); ++w) mask.words[w] |= more.words[w];
  }
  return mask;
}

template <class T, class Source>
void appendValues(std::span<const ImageBox<Source>> boxes, Coord local, const BrickMask& active,
                  std::vector<T>& to) {
  forEachActive(active, [&](int offset) {
    const Coord voxel = local + voxelLocal(offset);
    const auto at = [&](std::size_t c) {
      return boxes[c].voxels[offsetOf(boxes[c].strides, voxel)];
    };
    if constexpr (std::is_same_v<T, PackedVector>)
      to.push_back({float(at(0)), float(at(1)), float(at(2))});
    else
      to.push_back(T(at(0)));
  });
}

/// Packs the bricks of a box that differ in the fastest axis only.
template <class T, class Source>
void packRow(std::span<const ImageBox<Source>> boxes, Coord begin, int axis, const T& background,
             const PackingRule& rule, std::vector<PackedBrick>& bricks, std::vector<T>& values) {
  const Coord size = boxes.front().size;
  auto local = arrayOf(begin);
  for (auto& at = local[std::size_t(axis)]; at < arrayOf(size)[std::size_t(axis)];
       at += kBrickSide) {
    const Coord corner = coordOf(local);
    const BrickMask active = activeIn(boxes, corner, background, rule);
    if (active == BrickMask{}) continue;
    bricks.push_back({boxes.front().corner + corner, active, 0, values.size()});
    if constexpr (!std::is_same_v<T, bool>) appendValues(boxes, corner, active, values);
  }
  values.shrink_to_fit();
}

template <class Source>
void requireOnBricks(const ImageBox<Source>& box) {
  const Coord c = box.corner;
  if (c.x % kBrickSide || c.y % kBrickSide || c.z % kBrickSide)
    throw UsageError("a box of an image begins at " + toString(c) +
                     ", and its coordinates must be multiples of " + std::to_string(kBrickSide));
}

}  // namespace

std::string valueTypeOf(const PackedGrid& grid) {
  constexpr std::array kNames{"float", "int32", "int64", "bool", "vec3s"};
  return kNames[grid.voxels.index()];
}

std::span<const PackedBrick> bricksOf(const PackedGrid& grid) {
  return std::visit([](const auto& v) { return std::span<const PackedBrick>(v.bricks); },
                    grid.voxels);
}

std::uint64_t activeVoxelCount(const PackedGrid& grid) {
  const auto bricks = bricksOf(grid);
  return std::accumulate(bricks.begin(), bricks.end(), std::uint64_t{0},
                         [](std::uint64_t sum, const PackedBrick& brick) {
                           return sum + std::uint64_t(brick.active.count());
                         });
}

Box activeBox(const PackedGrid& grid) {
  Box box;
  for (const PackedBrick& brick : bricksOf(grid))
    forEachActive(brick.active, [&](int i) { box.expand(brick.corner + voxelLocal(i)); });
  return box;
}

PackedVoxels<float> packed(const SparseVolume& volume) {
  PackedVoxels<float> made{volume.background, {}, {{}}};
  std::vector<float>& values = made.parts.front();
  values.reserve(activeVoxelCount(volume));
  for (std::size_t b = 0; b < volume.brickCount(); ++b) {
    if (volume.active[b] == BrickMask{}) continue;
    made.bricks.push_back({volume.brickCorner(b), volume.active[b], 0, values.size()});
    const auto from = volume.brickValues(b);
    forEachActive(volume.active[b], [&](int i) { values.push_back(from[std::size_t(i)]); });
  }
  return made;
}

PackedVoxels<PackedVector> packed(const VectorGrid& vectors) {
  const VectorVolume volumes = aligned(vectors.components);
  PackedVoxels<PackedVector> made;
  for (std::size_t c = 0; c < kComponents; ++c) made.background[c] = volumes[c].background;
  std::vector<PackedVector>& values = made.parts.emplace_back();
  const SparseVolume& x = volumes.front();
  for (std::size_t b = 0; b < x.brickCount(); ++b) {
    if (x.active[b] == BrickMask{}) continue;
    made.bricks.push_back({x.brickCorner(b), x.active[b], 0, values.size()});
    forEachActive(x.active[b], [&](int offset) {
      PackedVector& to = values.emplace_back();
      for (std::size_t c = 0; c < kComponents; ++c)
        to[c] = volumes[c].brickValues(b)[std::size_t(offset)];
    });
  }
  return made;
}

SparseVolume unpacked(const PackedVoxels<float>& voxels) {
  std::vector<BrickInput> bricks(voxels.bricks.size());
  for (std::size_t b = 0; b < bricks.size(); ++b) {
    const PackedBrick& from = voxels.bricks[b];
    bricks[b].corner = from.corner;
    bricks[b].active = from.active;
    bricks[b].values.fill(voxels.background);
    forEachActive(from.active, [&, n = 0](int i) mutable {
      bricks[b].values[std::size_t(i)] = voxels.value(b, n++);
    });
  }
  return makeVolume(std::move(bricks), voxels.background);
}

template <class T>
template <class Source>
void GridPacker<T>::add(std::span<const ImageBox<Source>> boxes) {
  const ImageBox<Source>& box = boxes.front();
  requireOnBricks(box);
  const auto axes = axesByStride(box.strides);
  const auto size = arrayOf(box.size);
  const auto bricksAlong = [&](int a) {
    return (size[std::size_t(axes[std::size_t(a)])] + kBrickSide - 1) / kBrickSide;
  };
  const int second = bricksAlong(1);
  const std::size_t rows = std::size_t(bricksAlong(0)) * std::size_t(second);
  std::vector<std::vector<PackedBrick>> bricks(rows);
  std::vector<std::vector<T>> values(rows);
  tbb::parallel_for(std::size_t(0), rows, [&](std::size_t r) {
    std::array<std::int32_t, 3> begin{};
    begin[std::size_t(axes[0])] = std::int32_t(r) / second * kBrickSide;
    begin[std::size_t(axes[1])] = std::int32_t(r) % second * kBrickSide;
    packRow<T>(boxes, coordOf(begin), axes[2], made_.background, rule_, bricks[r], values[r]);
  });
  for (std::size_t r = 0; r < rows; ++r) {
    if (bricks[r].empty()) continue;
    for (PackedBrick& brick : bricks[r]) {
      brick.part = std::uint32_t(made_.parts.size());
      made_.bricks.push_back(brick);
    }
    valueBytes_ += values[r].size() * sizeof(T);
    made_.parts.push_back(std::move(values[r]));
  }
  requireWithinMemory(double(valueBytes_ + made_.bricks.size() * kBytesPerPackedBrick),
                      rule_.maxBytes, "the active voxels, of which a threshold leaves fewer,");
}

template <class T>
PackedVoxels<T> GridPacker<T>::finish() {
  auto& bricks = made_.bricks;
  std::ranges::sort(bricks, {}, &PackedBrick::corner);
  const auto same = std::ranges::adjacent_find(bricks, {}, &PackedBrick::corner);
  if (same != bricks.end())
    throw UsageError("two boxes of the image have the voxel " + toString(same->corner));
  return std::exchange(made_, {});
}

template class GridPacker<float>;
template class GridPacker<std::int32_t>;
template class GridPacker<std::int64_t>;
template class GridPacker<bool>;
template class GridPacker<PackedVector>;

template void GridPacker<float>::add(std::span<const ImageBox<std::int8_t>>);
template void GridPacker<float>::add(std::span<const ImageBox<std::uint8_t>>);
template void GridPacker<float>::add(std::span<const ImageBox<std::int16_t>>);
template void GridPacker<float>::add(std::span<const ImageBox<std::uint16_t>>);
template void GridPacker<float>::add(std::span<const ImageBox<std::int32_t>>);
template void GridPacker<float>::add(std::span<const ImageBox<std::uint32_t>>);
template void GridPacker<float>::add(std::span<const ImageBox<float>>);
template void GridPacker<float>::add(std::span<const ImageBox<double>>);
template void GridPacker<std::int32_t>::add(std::span<const ImageBox<std::int64_t>>);
template void GridPacker<std::int64_t>::add(std::span<const ImageBox<std::int64_t>>);
template void GridPacker<bool>::add(std::span<const ImageBox<bool>>);
template void GridPacker<PackedVector>::add(std::span<const ImageBox<float>>);

}  // namespace esvr
