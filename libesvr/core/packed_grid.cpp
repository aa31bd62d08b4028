#include "esvr/grid.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numeric>

#include "core/parallel.h"
#include "esvr/device.h"
#include "esvr/error.h"

namespace esvr {
namespace {

using Strides = std::array<std::ptrdiff_t, 3>;

/// A number in the type of an image, if that type has it. The doubles next to the largest integers of 64
/// bits are out of their range.
template <class Source>
std::optional<Source> exactly(double value) {
  using Limits = std::numeric_limits<Source>;
  constexpr bool kRounded = std::is_integral_v<Source> && sizeof(Source) == sizeof(std::int64_t);
  const double largest = double(Limits::max());
  if (!(value >= double(Limits::lowest())) || !(kRounded ? value < largest : value <= largest))
    return std::nullopt;
  const auto source = Source(value);
  return double(source) == value ? std::optional(source) : std::nullopt;
}
template <class Source>
std::optional<Source> exactly(std::int64_t value) {
  if constexpr (std::is_integral_v<Source> && !std::is_same_v<Source, bool>)
    return std::in_range<Source>(value) ? std::optional(Source(value)) : std::nullopt;
  else
    return exactly<Source>(double(value));
}

/// The smallest number of an image's type that is not below a threshold; nothing if there is none.
template <class Source>
std::optional<Source> smallestFrom(double threshold) {
  using Limits = std::numeric_limits<Source>;
  if (threshold <= double(Limits::lowest())) return Limits::lowest();
  if constexpr (std::is_integral_v<Source>) {
    return exactly<Source>(std::ceil(threshold));
  } else {
    if (!(threshold <= double(Limits::max()))) return std::nullopt;
    const auto nearest = Source(threshold);
    return double(nearest) < threshold ? std::nextafter(nearest, Limits::infinity()) : nearest;
  }
}

/// Calls use(test) with a test that says whether a value of the image is active. It compares in the type
/// of the image, without a conversion of each voxel.
template <class Source, class Background, class Use>
BrickMask withTest(const PackingRule& rule, Background background, const Use& use) {
  if (rule.threshold) {
    const auto limit = smallestFrom<Source>(*rule.threshold);
    if (!limit) return {};
    return use([least = *limit](Source value) { return value >= least; });
  }
  const auto inactive = exactly<Source>(background);
  if (!inactive) return use([](Source) { return true; });
  return use([only = *inactive](Source value) { return value != only; });
}

/// The axes from the one with the largest step in memory to the one with the smallest.
std::array<int, 3> axesByStride(const Strides& strides) {
  std::array<int, 3> axes{0, 1, 2};
  std::ranges::stable_sort(axes, [&](int a, int b) {
    return std::abs(strides[std::size_t(a)]) > std::abs(strides[std::size_t(b)]);
  });
  return axes;
}

std::array<std::int32_t, 3> arrayOf(Coord c) { return {c.x, c.y, c.z}; }
Coord coordOf(const std::array<std::int32_t, 3>& a) { return {a[0], a[1], a[2]}; }

std::ptrdiff_t offsetOf(const Strides& strides, Coord voxel) {
  return strides[0] * voxel.x + strides[1] * voxel.y + strides[2] * voxel.z;
}

/// Finds the active voxels of the bricks of an array.
class MaskMaker {
 public:
  explicit MaskMaker(const Strides& strides) : strides_(strides) {
    const auto axes = axesByStride(strides);
    for (std::size_t a = 0; a < 3; ++a) {
      constexpr std::array<int, 3> kShifts{6, 3, 0};  // voxelOffset shifts coordinates so
      axes_[a] = std::size_t(axes[a]);
      steps_[a] = strides[axes_[a]];
      shifts_[a] = kShifts[axes_[a]];
    }
  }

  /// \param local  the brick's corner in the array, whose size is given
  /// \param test   says whether a value of the array is active
  template <class Value, class Test>
  BrickMask mask(const Value* values, Coord local, Coord size, const Test& test) const {
    const auto begin = arrayOf(local);
    const auto end = arrayOf(minCoord(local + Coord{kBrickSide, kBrickSide, kBrickSide}, size));
    const auto count = [&](std::size_t a) { return end[axes_[a]] - begin[axes_[a]]; };
    const Value* const first = values + offsetOf(strides_, local);
    const bool isPlainRow = steps_[2] == 1 && count(2) == kBrickSide;
    BrickMask mask;
    for (int i = 0; i < count(0); ++i)
      for (int j = 0; j < count(1); ++j) {
        const Value* const row = first + i * steps_[0] + j * steps_[1];
        const unsigned bits =
            isPlainRow ? rowBits<kBrickSide>(row, test) : rowBits(row, steps_[2], count(2), test);
        if (bits != 0) scatter(bits, (i << shifts_[0]) | (j << shifts_[1]), mask);
      }
    return mask;
  }

 private:
  /// Active voxels of a row, one bit for each.
  template <int kCount, class Value, class Test>
  static unsigned rowBits(const Value* row, const Test& test) {
    unsigned bits = 0;
    for (int k = 0; k < kCount; ++k) bits |= unsigned(test(row[k])) << k;
    return bits;
  }
  template <class Value, class Test>
  static unsigned rowBits(const Value* row, std::ptrdiff_t step, int count, const Test& test) {
    unsigned bits = 0;
    for (int k = 0; k < count; ++k) bits |= unsigned(test(row[k * step])) << k;
    return bits;
  }

  /// Sets the voxels of a row whose first voxel has this offset.
  void scatter(unsigned bits, int offset, BrickMask& mask) const {
    for (; bits != 0; bits &= bits - 1) mask.set(offset | (std::countr_zero(bits) << shifts_[2]));
  }

  Strides strides_, steps_{};
  std::array<std::size_t, 3> axes_{};
  std::array<int, 3> shifts_{};
};

template <class T>
auto backgroundNumber(const T& background, std::size_t component) {
  if constexpr (std::is_same_v<T, PackedVector>)
    return double(background[component]);
  else if constexpr (std::is_integral_v<T>)
    return std::int64_t(background);
  else
    return double(background);
}

/// The active voxels of a brick of an image.
template <class T, class Source>
BrickMask activeIn(std::span<const ImageBox<Source>> boxes, Coord local, const T& background,
                   const PackingRule& rule) {
  const ImageBox<Source>& box = boxes.front();
  BrickMask given;
  if (box.active) {
    given =
        MaskMaker(box.activeStrides).mask(box.active, local, box.size, [](bool on) { return on; });
    if (!std::is_same_v<T, bool> || given == BrickMask{}) return given;
  }
  BrickMask found;
  for (std::size_t c = 0; c < boxes.size(); ++c) {
    const MaskMaker maker(boxes[c].strides);
    const BrickMask more = withTest<Source>(
        rule, backgroundNumber(background, c),
        [&](const auto& test) { return maker.mask(boxes[c].voxels, local, boxes[c].size, test); });
    for (std::size_t w = 0; w < found.words.size(); ++w) found.words[w] |= more.words[w];
  }
  for (std::size_t w = 0; box.active && w < found.words.size(); ++w)
    found.words[w] &= given.words[w];
  return found;
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
      to.push_back({at(0), at(1), at(2)});
    else
      to.push_back(T(at(0)));
  });
}

/// Packs the bricks of a box that differ in one axis only.
template <class T, class Source>
void packRow(std::span<const ImageBox<Source>> boxes, Coord begin, int axis, const T& background,
             const PackingRule& rule, std::vector<PackedBrick>& bricks, std::vector<T>& values) {
  const auto size = arrayOf(boxes.front().size);
  auto local = arrayOf(begin);
  for (auto& at = local[std::size_t(axis)]; at < size[std::size_t(axis)]; at += kBrickSide) {
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
  const auto corner = arrayOf(box.corner), size = arrayOf(box.size);
  for (std::size_t a = 0; a < 3; ++a) {
    if (corner[a] % kBrickSide != 0)
      throw UsageError("a box of an image begins at " + toString(box.corner) +
                       ", and its coordinates must be multiples of " + std::to_string(kBrickSide));
    // The last brick may reach beyond the box.
    if (std::int64_t(corner[a]) + size[a] > Box::kMax - kBrickSide)
      throw UsageError("a box of an image ends outside the index space");
  }
}

/// Packs the active voxels of a volume as values of another type.
template <class T>
PackedVoxels<T> packedAs(const SparseVolume& volume, T background) {
  PackedVoxels<T> made{background, {}, {{}}};
  std::vector<T>& values = made.parts.front();
  values.reserve(activeVoxelCount(volume));
  for (std::size_t b = 0; b < volume.brickCount(); ++b) {
    if (volume.active[b] == BrickMask{}) continue;
    made.bricks.push_back({volume.brickCorner(b), volume.active[b], 0, values.size()});
    const auto from = volume.brickValues(b);
    forEachActive(volume.active[b], [&](int i) { values.push_back(T(from[std::size_t(i)])); });
  }
  return made;
}

}  // namespace

std::string valueTypeOf(const PackedGrid& grid) {
  constexpr std::array kNames{"float", "double", "int32", "int64", "bool", "vec3s"};
  static_assert(kNames.size() == std::variant_size_v<AnyPackedVoxels>);
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

PackedGrid packed(const GridDescriptor& descriptor, const SparseVolume& volume) {
  if (descriptor.valueType == ValueType::kDouble)
    return {descriptor, packedAs<double>(volume, descriptor.background)};
  return {descriptor, packedAs<float>(volume, volume.background)};
}

PackedGrid packed(const VectorGrid& vectors) {
  const VectorVolume volumes = aligned(vectors.components);
  PackedVoxels<PackedVector> made;
  for (std::size_t c = 0; c < kComponents; ++c) made.background[c] = float(vectors.background[c]);
  const SparseVolume& x = volumes.front();
  std::vector<PackedVector>& values = made.parts.emplace_back();
  values.reserve(activeVoxelCount(x));
  for (std::size_t b = 0; b < x.brickCount(); ++b) {
    if (x.active[b] == BrickMask{}) continue;
    made.bricks.push_back({x.brickCorner(b), x.active[b], 0, values.size()});
    forEachActive(x.active[b], [&](int offset) {
      PackedVector& to = values.emplace_back();
      for (std::size_t c = 0; c < kComponents; ++c)
        to[c] = volumes[c].brickValues(b)[std::size_t(offset)];
    });
  }
  return {vectors.descriptor, std::move(made)};
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
  parallelFor(std::size_t(0), rows, [&](std::size_t r) {
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
    throw UsageError("two boxes of the image have voxels of the brick at " +
                     toString(same->corner));
  valueBytes_ = 0;
  return std::exchange(made_, PackedVoxels<T>{made_.background, {}, {}});
}

// The types of grids, and the types of images that they hold exactly.
template class GridPacker<float>;
template class GridPacker<double>;
template class GridPacker<std::int32_t>;
template class GridPacker<std::int64_t>;
template class GridPacker<bool>;
template class GridPacker<PackedVector>;

template void GridPacker<float>::add(std::span<const ImageBox<std::int8_t>>);
template void GridPacker<float>::add(std::span<const ImageBox<std::uint8_t>>);
template void GridPacker<float>::add(std::span<const ImageBox<std::int16_t>>);
template void GridPacker<float>::add(std::span<const ImageBox<std::uint16_t>>);
template void GridPacker<float>::add(std::span<const ImageBox<float>>);
template void GridPacker<double>::add(std::span<const ImageBox<std::int8_t>>);
template void GridPacker<double>::add(std::span<const ImageBox<std::uint8_t>>);
template void GridPacker<double>::add(std::span<const ImageBox<std::int16_t>>);
template void GridPacker<double>::add(std::span<const ImageBox<std::uint16_t>>);
template void GridPacker<double>::add(std::span<const ImageBox<std::int32_t>>);
template void GridPacker<double>::add(std::span<const ImageBox<std::uint32_t>>);
template void GridPacker<double>::add(std::span<const ImageBox<float>>);
template void GridPacker<double>::add(std::span<const ImageBox<double>>);
template void GridPacker<std::int32_t>::add(std::span<const ImageBox<std::int8_t>>);
template void GridPacker<std::int32_t>::add(std::span<const ImageBox<std::uint8_t>>);
template void GridPacker<std::int32_t>::add(std::span<const ImageBox<std::int16_t>>);
template void GridPacker<std::int32_t>::add(std::span<const ImageBox<std::uint16_t>>);
template void GridPacker<std::int32_t>::add(std::span<const ImageBox<std::int32_t>>);
template void GridPacker<std::int64_t>::add(std::span<const ImageBox<std::int8_t>>);
template void GridPacker<std::int64_t>::add(std::span<const ImageBox<std::uint8_t>>);
template void GridPacker<std::int64_t>::add(std::span<const ImageBox<std::int16_t>>);
template void GridPacker<std::int64_t>::add(std::span<const ImageBox<std::uint16_t>>);
template void GridPacker<std::int64_t>::add(std::span<const ImageBox<std::int32_t>>);
template void GridPacker<std::int64_t>::add(std::span<const ImageBox<std::uint32_t>>);
template void GridPacker<std::int64_t>::add(std::span<const ImageBox<std::int64_t>>);
template void GridPacker<bool>::add(std::span<const ImageBox<bool>>);
template void GridPacker<PackedVector>::add(std::span<const ImageBox<float>>);

}  // namespace esvr
