// The values that the codes of a voxel layer stand for, and the volume that a layer holds.

#include "esvr/quantised.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "codec/voxel_coder.h"
#include "core/parallel.h"

namespace esvr {
namespace codec {
namespace {

constexpr double kLargestCode = 0x1p30;
constexpr int kFloatMantissa = 23, kHalfMantissa = 10;
constexpr std::int32_t kHalfBits = 0x7fff;

/// The value of a code of a lattice. The code next to the largest float may stand for a larger number, which no
/// float holds.
float latticeValue(std::int32_t code, double divisor) {
  constexpr double kLargest = std::numeric_limits<float>::max();
  return float(std::clamp(double(code) / divisor, -kLargest, kLargest));
}

/// The nearest code of a value, ties away from 0. A conversion that cuts off fractions is one instruction for
/// several voxels, which std::lround is not.
std::int32_t latticeCode(float value, double divisor) {
  const double place = std::clamp(double(value) * divisor, -kLargestCode, kLargestCode);
  return std::int32_t(place + std::copysign(0.5, place));
}

/// The number of a float in increasing order. -0 comes before 0, so every bit pattern has its own.
std::int32_t orderOf(std::int32_t magnitude, bool negative) {
  return negative ? -1 - magnitude : magnitude;
}

}  // namespace

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
std::int32_t orderOfHalf(float v) {
  constexpr std::int32_t kOffset = 112;      // difference of the exponents' offsets
  constexpr std::int32_t kLargest = 0x7bff;  // 65504
  const float magnitude = std::abs(v);
  if (magnitude < 0x1p-14f) return orderOf(std::int32_t(magnitude * 0x1p24f), std::signbit(v));
  const auto bits = std::bit_cast<std::int32_t>(magnitude) >> (kFloatMantissa - kHalfMantissa);
  return orderOf(std::min(bits - (kOffset << kHalfMantissa), kLargest), std::signbit(v));
}

float nearestHalf(float v) {
  constexpr float kLargest = 65504.0f, kSmallestNormal = 0x1p-14f, kSmallest = 0x1p-24f;
  // Between 0.5 and 1, floats are as far apart as subnormal halfs. Adding this number rounds to them.
  constexpr float kRounder = 0.75f;
  constexpr int kDropped = kFloatMantissa - kHalfMantissa;
  constexpr std::uint32_t kBelowTie = (1u << (kDropped - 1)) - 1u,
                          kDroppedBits = (1u << kDropped) - 1u;
  const float magnitude = std::abs(v);
  if (!(magnitude < kLargest)) return std::isnan(v) ? v : std::copysign(kLargest, v);
  float rounded = 0.0f;
  if (magnitude < kSmallestNormal) {
    rounded = (magnitude + kRounder) - kRounder;
  } else {
    const auto bits = std::bit_cast<std::uint32_t>(magnitude);
    const std::uint32_t even = (bits >> kDropped) & 1u;
    rounded = std::bit_cast<float>((bits + kBelowTie + even) & ~kDroppedBits);
  }
  if (rounded == 0.0f && v < 0.0f) rounded = kSmallest;
  return std::copysign(std::min(rounded, kLargest), v);
}

VoxelLayer headOf(const VoxelLayer& layer) {
  VoxelLayer head;
  head.form = layer.form;
  head.divisor = layer.divisor;
  head.palette = layer.palette;
  head.origin = layer.origin;
  head.background = layer.background;
  return head;
}

VoxelLayer partOf(const VoxelLayer& layer, std::span<const std::size_t> bricks) {
  VoxelLayer part = headOf(layer);
  for (const std::size_t b : bricks) {
    const auto codes = layer.codes.begin() + std::ptrdiff_t(b * kBrickVoxels);
    part.bricks.push_back(layer.bricks[b]);
    part.active.push_back(layer.active[b]);
    part.vacant.push_back(layer.vacant[b]);
    part.codes.insert(part.codes.end(), codes, codes + kBrickVoxels);
  }
  return part;
}

float valueOfCode(const VoxelLayer& layer, std::int32_t n) {
  switch (layer.form) {
    case VoxelForm::kQuantised:
      return latticeValue(n, layer.divisor);
    case VoxelForm::kHalf:
      return halfAt(n);
    case VoxelForm::kPalette:
      return layer.palette[std::size_t(n)];
    case VoxelForm::kFloat:
      break;
  }
  return floatAt(n);
}

std::int32_t codeOfValue(const VoxelLayer& layer, float v) {
  switch (layer.form) {
    case VoxelForm::kQuantised:
      return latticeCode(v, layer.divisor);
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

void valuesOfCodes(const VoxelLayer& layer, std::span<const std::int32_t> codes,
                   std::span<float> values) {
  if (layer.form == VoxelForm::kQuantised)
    std::ranges::transform(codes, values.begin(), [divisor = layer.divisor](std::int32_t code) {
      return latticeValue(code, divisor);
    });
  else
    std::ranges::transform(codes, values.begin(),
                           [&](std::int32_t code) { return valueOfCode(layer, code); });
}

void codesOfValues(const VoxelLayer& layer, std::span<const float> values,
                   std::span<std::int32_t> codes) {
  if (layer.form == VoxelForm::kQuantised)
    std::ranges::transform(values, codes.begin(), [divisor = layer.divisor](float value) {
      return latticeCode(value, divisor);
    });
  else
    std::ranges::transform(values, codes.begin(),
                           [&](float value) { return codeOfValue(layer, value); });
}

}  // namespace codec

SparseVolume volumeOf(const VoxelLayer& layer) {
  SparseVolume volume;
  volume.origin = layer.origin;
  volume.background = layer.background;
  volume.bricks = layer.bricks;
  volume.active = layer.active;
  volume.values = VoxelArray<float>(layer.codes.size(), layer.codes.get_allocator());
  parallelFor(std::size_t{0}, layer.bricks.size(), [&](std::size_t b) {
    const auto values = volume.brickValues(b);
    const std::span codes(&layer.codes[b * kBrickVoxels], std::size_t(kBrickVoxels));
    const BrickMask& vacant = layer.vacant[b];
    if (layer.form != VoxelForm::kPalette) {
      codec::valuesOfCodes(layer, codes, values);
      for (int v = 0; v < kBrickVoxels; ++v)
        values[std::size_t(v)] = vacant.test(v) ? layer.background : values[std::size_t(v)];
      return;
    }
    // The code of a vacant voxel need not be in the palette.
    for (int v = 0; v < kBrickVoxels; ++v)
      values[std::size_t(v)] =
          vacant.test(v) ? layer.background : codec::valueOfCode(layer, codes[std::size_t(v)]);
  });
  return volume;
}

void roundToHalfs(SparseVolume& volume) {
  parallelFor(std::size_t{0}, volume.brickCount(), [&](std::size_t b) {
    const auto values = volume.brickValues(b);
    for (int v = 0; v < kBrickVoxels; ++v)
      if (volume.active[b].test(v)) values[v] = codec::nearestHalf(values[v]);
  });
}

bool allFinite(const VoxelLayer& layer) {
  // Quantised values are limited to floats, and halfs have no infinity here. Most floats need no second look.
  if (layer.form == VoxelForm::kHalf) return true;
  if (layer.form == VoxelForm::kQuantised && layer.divisor > 0.0) return true;
  constexpr std::int32_t kLargest = 0x7f7fffff;
  const auto isSuspect = [&](std::int32_t code) {
    return layer.form != VoxelForm::kFloat || code > kLargest || code < -1 - kLargest;
  };
  for (std::size_t b = 0; b < layer.bricks.size(); ++b) {
    const std::int32_t* codes = &layer.codes[b * kBrickVoxels];
    bool suspect = false;
    for (int v = 0; v < kBrickVoxels; ++v) suspect |= isSuspect(codes[v]);
    for (int v = 0; suspect && v < kBrickVoxels; ++v)
      if (!std::isfinite(codec::valueOfCode(layer, codes[v])) && !layer.vacant[b].test(v))
        return false;
  }
  return true;
}

}  // namespace esvr
