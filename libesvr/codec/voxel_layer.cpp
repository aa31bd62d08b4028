#include "esvr/voxel_layer.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>
#include <unordered_set>

#include "esvr/error.h"

namespace esvr {
namespace {

using Limits = std::numeric_limits<std::int32_t>;

constexpr std::size_t kLargestPalette = 4096;
constexpr double kMargin = 1.0 - 1e-6;  // factor of a bound, which leaves room for rounding
constexpr double kLargestCode = 0x1p30;
constexpr int kFloatMantissa = 23, kHalfMantissa = 10, kHalfLowest = -14, kHalfHighest = 15;
constexpr std::int32_t kHalfOne = 1 << kHalfMantissa, kHalfSign = 0x8000, kHalfBits = 0x7fff;

bool sameBits(float a, float b) {
  return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
}

/// The number of a float in increasing order. -0 comes before 0, so every bit pattern has its own.
std::int32_t orderOf(std::int32_t magnitude, bool negative) {
  return negative ? -1 - magnitude : magnitude;
}

float floatAt(std::int32_t n) {
  const auto magnitude = std::uint32_t(n < 0 ? -1 - n : n);
  return std::bit_cast<float>(n < 0 ? magnitude | 0x80000000u : magnitude);
}
std::int32_t orderOfFloat(float v) {
  return orderOf(std::int32_t(std::bit_cast<std::uint32_t>(v) & 0x7fffffffu), std::signbit(v));
}

bool inOrder(float a, float b) { return orderOfFloat(a) < orderOfFloat(b); }

/// The bits of a half, moved to those of a float, are the half times 2^-112, which is the
/// difference of the exponents' offsets. The product is exact, also for subnormal halves.
float halfAt(std::int32_t n) {
  const std::int32_t bits = (n < 0 ? -1 - n : n) & kHalfBits;
  const auto moved = std::bit_cast<float>(std::uint32_t(bits) << (kFloatMantissa - kHalfMantissa));
  return std::copysign(moved * 0x1p112f, n < 0 ? -1.0f : 1.0f);
}
/// The number of the half that is nearest to v among those of no larger magnitude. v is a half if
/// halfAt() of the result equals v.
std::int32_t orderOfHalf(float v) {
  const double magnitude = std::abs(double(v));
  int exponent = magnitude > 0.0 ? std::ilogb(magnitude) : kHalfLowest;
  exponent = std::clamp(exponent, kHalfLowest, kHalfHighest);
  const double mantissa = std::floor(std::ldexp(magnitude, kHalfMantissa - exponent));
  const auto steps = std::int32_t(std::min(mantissa, 2.0 * kHalfOne - 1.0));
  const bool subnormal = steps < kHalfOne;
  const std::int32_t bits =
      subnormal ? steps : ((exponent + kHalfHighest) << kHalfMantissa) + steps - kHalfOne;
  return orderOf(bits, std::signbit(v));
}

float valueAt(const VoxelLayer& layer, std::int32_t n) {
  switch (layer.form) {
    case VoxelForm::kQuantised:
      return float(double(n) / layer.divisor);
    case VoxelForm::kHalf:
      return halfAt(n);
    case VoxelForm::kPalette:
      return layer.palette[std::size_t(n)];
    case VoxelForm::kFloat:
      break;
  }
  return floatAt(n);
}

std::int32_t codeOf(const VoxelLayer& layer, float v) {
  switch (layer.form) {
    case VoxelForm::kQuantised:
      return std::int32_t(
          std::lround(std::clamp(double(v) * layer.divisor, -kLargestCode, kLargestCode)));
    case VoxelForm::kHalf:
      return orderOfHalf(v);
    case VoxelForm::kPalette:
      return std::int32_t(std::lower_bound(layer.palette.begin(), layer.palette.end(), v, inOrder) -
                          layer.palette.begin());
    case VoxelForm::kFloat:
      break;
  }
  return orderOfFloat(v);
}

/// The distinct values of a volume in increasing order; empty if there are too many for a palette.
std::vector<float> paletteOf(const SparseVolume& volume) {
  std::unordered_set<std::int32_t> orders;
  std::optional<std::int32_t> last;
  for (const float v : volume.values) {
    const std::int32_t order = orderOfFloat(v);
    if (last == order) continue;
    orders.insert(*(last = order));
    if (orders.size() > kLargestPalette) return {};
  }
  std::vector<float> values;
  for (const std::int32_t order : orders) values.push_back(floatAt(order));
  std::sort(values.begin(), values.end(), inOrder);
  return values;
}

bool allHalves(const SparseVolume& volume) {
  return std::all_of(volume.values.begin(), volume.values.end(),
                     [](float v) { return sameBits(halfAt(orderOfHalf(v)), v); });
}

void fill(const SparseVolume& volume, VoxelLayer& layer) {
  layer.origin = volume.origin;
  layer.background = volume.background;
  layer.bricks = volume.bricks;
  layer.active = volume.active;
  layer.vacant.resize(volume.brickCount());
  layer.codes = VoxelArray<std::int32_t>(volume.values.size(), memoryOf(volume));
  tbb::parallel_for(std::size_t{0}, volume.brickCount(), [&](std::size_t b) {
    const auto values = volume.brickValues(b);
    for (int v = 0; v < kBrickVoxels; ++v) {
      if (!volume.active[b].test(v) && sameBits(values[v], volume.background))
        layer.vacant[b].set(v);
      layer.codes[b * kBrickVoxels + std::size_t(v)] = codeOf(layer, values[v]);
    }
  });
}

/// The largest error that rounding the values of a quantisation lattice to float32 adds.
double roundingError(const SparseVolume& volume, double bound) {
  double largest = 0.0;
  for (const float v : volume.values) largest = std::max(largest, std::abs(double(v)));
  return (largest + bound) * 0x1p-24;
}

/// The voxels of a volume, rounded to multiples of two half steps.
VoxelLayer quantised(const SparseVolume& volume, double halfStep) {
  VoxelLayer layer;
  layer.form = VoxelForm::kQuantised;
  layer.divisor = 0.5 / halfStep;
  fill(volume, layer);
  return layer;
}

/// Removes the bricks without an active voxel.
void dropInactive(VoxelLayer& layer) {
  std::size_t kept = 0;
  for (std::size_t b = 0; b < layer.bricks.size(); ++b) {
    if (layer.active[b].count() == 0) continue;
    layer.bricks[kept] = layer.bricks[b];
    layer.active[kept] = layer.active[b];
    layer.vacant[kept] = layer.vacant[b];
    const auto from = layer.codes.begin() + std::ptrdiff_t(b * kBrickVoxels);
    std::copy_n(from, kBrickVoxels, layer.codes.begin() + std::ptrdiff_t(kept * kBrickVoxels));
    ++kept;
  }
  layer.bricks.resize(kept);
  layer.active.resize(kept);
  layer.vacant.resize(kept);
  layer.codes.resize(kept * kBrickVoxels);
}

void activateByValue(const SparseVolume& volume, double bound, VoxelLayer& layer) {
  const std::int32_t background = codeOf(layer, volume.background);
  tbb::parallel_for(std::size_t{0}, volume.brickCount(), [&](std::size_t b) {
    const auto values = volume.brickValues(b);
    layer.active[b] = {};
    for (int v = 0; v < kBrickVoxels; ++v) {
      if (std::abs(double(values[v]) - volume.background) > bound) {
        layer.active[b].set(v);
        continue;
      }
      layer.vacant[b].set(v);
      layer.codes[b * kBrickVoxels + std::size_t(v)] = background;
    }
  });
  dropInactive(layer);
}

}  // namespace

VoxelLayer exactLayer(const SparseVolume& volume) {
  VoxelLayer layer;
  layer.palette = paletteOf(volume);
  layer.form = !layer.palette.empty() ? VoxelForm::kPalette
               : allHalves(volume)    ? VoxelForm::kHalf
                                      : VoxelForm::kFloat;
  fill(volume, layer);
  return layer;
}

VoxelLayer boundedLayer(const SparseVolume& volume, double bound, Activity activity) {
  if (!(std::isfinite(bound) && bound > 0.0))
    throw UsageError("the largest error must be above 0, not " + std::to_string(bound));
  // Multiples of twice the bound are nearly exact on the first lattice. Its values may miss the
  // bound where they are rounded to float32; the second lattice is finer and leaves room for that.
  const double halfStep = bound * kMargin;
  for (const double h : {halfStep, halfStep - roundingError(volume, bound)}) {
    if (!(h > 0.0)) break;
    VoxelLayer layer = quantised(volume, h);
    if (activity == Activity::kByValue) activateByValue(volume, halfStep, layer);
    if (largestError(volume, layer) <= bound) return layer;
  }
  return exactLayer(volume);
}

SparseVolume volumeOf(const VoxelLayer& layer) {
  SparseVolume volume;
  volume.origin = layer.origin;
  volume.background = layer.background;
  volume.bricks = layer.bricks;
  volume.active = layer.active;
  volume.values = VoxelArray<float>(layer.codes.size(), layer.codes.get_allocator());
  tbb::parallel_for(std::size_t{0}, layer.bricks.size(), [&](std::size_t b) {
    for (std::size_t v = 0; v < kBrickVoxels; ++v) {
      const std::size_t i = b * kBrickVoxels + v;
      volume.values[i] =
          layer.vacant[b].test(int(v)) ? layer.background : valueAt(layer, layer.codes[i]);
    }
  });
  return volume;
}

bool allFinite(const VoxelLayer& layer) {
  for (std::size_t i = 0; i < layer.codes.size(); ++i)
    if (!std::isfinite(valueAt(layer, layer.codes[i])) &&
        !layer.vacant[i / kBrickVoxels].test(int(i % kBrickVoxels)))
      return false;
  return true;
}

namespace {

/// The largest difference over brick i of `a`.
double largestOver(const SparseVolume& a, std::size_t i, const SparseVolume& b) {
  const auto at = findBrick(b, brickOf(a.brickCorner(i)) - brickOf(b.origin));
  double largest = 0.0;
  for (std::size_t v = 0; v < kBrickVoxels; ++v) {
    const float other = at ? b.brickValues(*at)[v] : b.background;
    largest = std::max(largest, std::abs(double(a.brickValues(i)[v]) - double(other)));
  }
  return largest;
}

/// The largest difference over the bricks of `a`.
double largestOver(const SparseVolume& a, const SparseVolume& b) {
  using BrickRange = tbb::blocked_range<std::size_t>;
  const auto largest = [](double x, double y) { return std::max(x, y); };
  return tbb::parallel_reduce(
      BrickRange(0, a.brickCount()), 0.0,
      [&](const BrickRange& bricks, double found) {
        for (std::size_t i = bricks.begin(); i != bricks.end(); ++i)
          found = largest(found, largestOver(a, i, b));
        return found;
      },
      largest);
}

}  // namespace

double largestDifference(const SparseVolume& a, const SparseVolume& b) {
  return std::max(largestOver(a, b), largestOver(b, a));
}

double largestError(const SparseVolume& volume, const VoxelLayer& layer) {
  return largestDifference(volume, volumeOf(layer));
}

}  // namespace esvr
