// Voxel layers for an encoder: exact ones, ones within a bound, and ones whose codes take fewer bits.

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <unordered_set>
#include <utility>

#include "codec/brick_coder.h"
#include "codec/frame_coder.h"
#include "codec/voxel_coder.h"
#include "core/counted.h"
#include "core/parallel.h"
#include "esvr/error.h"
#include "esvr/quantised.h"

namespace esvr {

// ---- The distance of two volumes

namespace {

/// The largest difference over brick i of `a`.
double largestOver(const SparseVolume& a, std::size_t i, const SparseVolume& b) {
  const auto at = brickWith(b, a.brickCorner(i));
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
  return parallelReduce(
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

// ---- Exact layers

namespace {

constexpr std::size_t kLargestPalette = 4096;
/// Bricks whose values one thread collects.
constexpr std::size_t kBricksOfPart = 256;

bool sameBits(float a, float b) {
  return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
}

/// The distinct values of a volume in increasing order; empty if there are too many for a palette.
std::vector<float> paletteOf(const SparseVolume& volume) {
  using Range = tbb::blocked_range<std::size_t>;
  using Orders = std::unordered_set<std::int32_t>;  // numbers of floats in increasing order
  std::atomic<bool> areTooMany{false};
  const auto joined = [&](Orders a, const Orders& b) {
    if (!areTooMany) a.insert(b.begin(), b.end());
    if (a.size() > kLargestPalette) areTooMany = true;
    return a;
  };
  const Orders orders = parallelReduce(
      Range(0, volume.brickCount(), kBricksOfPart), Orders{},
      [&](const Range& bricks, Orders found) {
        std::optional<std::int32_t> last;
        for (std::size_t b = bricks.begin(); b != bricks.end() && !areTooMany; ++b) {
          for (const float v : volume.brickValues(b)) {
            const std::int32_t order = codec::orderOfFloat(v);
            if (last != order) found.insert(*(last = order));
          }
          if (found.size() > kLargestPalette) areTooMany = true;
        }
        return found;
      },
      joined);
  if (areTooMany) return {};
  std::vector<float> values;
  for (const std::int32_t order : orders) values.push_back(codec::floatAt(order));
  std::sort(values.begin(), values.end(), codec::inOrder);
  return values;
}

bool allHalves(const SparseVolume& volume) {
  using Range = tbb::blocked_range<std::size_t>;
  return parallelReduce(
      Range(0, volume.brickCount()), true,
      [&](const Range& bricks, bool all) {
        for (std::size_t b = bricks.begin(); all && b != bricks.end(); ++b)
          all = std::ranges::all_of(volume.brickValues(b), [](float v) {
            return sameBits(codec::halfAt(codec::orderOfHalf(v)), v);
          });
        return all;
      },
      std::logical_and<>());
}

/// The voxels of a brick that differ from the background by more than a bound.
BrickMask differing(std::span<const float> values, float background, double bound) {
  BrickMask mask;
  for (std::size_t w = 0; w < mask.words.size(); ++w) {
    std::uint64_t word = 0;
    for (std::size_t bit = 0; bit < 64; ++bit)
      word |= std::uint64_t{std::abs(double(values[w * 64 + bit]) - background) > bound} << bit;
    mask.words[w] = word;
  }
  return mask;
}

/// The inactive voxels of a brick that have the background, bit by bit.
BrickMask vacantOf(std::span<const float> values, float background, const BrickMask& active) {
  BrickMask mask;
  for (std::size_t w = 0; w < mask.words.size(); ++w) {
    std::uint64_t word = 0;
    for (std::size_t bit = 0; active.words[w] != ~std::uint64_t{0} && bit < 64; ++bit)
      word |= std::uint64_t{sameBits(values[w * 64 + bit], background)} << bit;
    mask.words[w] = word & ~active.words[w];
  }
  return mask;
}

/// Codes all voxels of a volume. With kKept, the code of a negative value is negative.
void fill(const SparseVolume& volume, RoundedSigns signs, VoxelLayer& layer) {
  layer.origin = volume.origin;
  layer.background = volume.background;
  layer.bricks = volume.bricks;
  layer.active = volume.active;
  layer.vacant.resize(volume.brickCount());
  layer.codes = VoxelArray<std::int32_t>(volume.values.size(), memoryOf(volume));
  parallelFor(std::size_t{0}, volume.brickCount(), [&](std::size_t b) {
    const auto values = volume.brickValues(b);
    const std::span codes(&layer.codes[b * kBrickVoxels], std::size_t(kBrickVoxels));
    layer.vacant[b] = vacantOf(values, volume.background, volume.active[b]);
    codec::codesOfValues(layer, values, codes);
    if (signs == RoundedSigns::kKept)
      for (std::size_t v = 0; v < codes.size(); ++v)
        codes[v] = values[v] < 0.0f ? std::min(codes[v], -1) : codes[v];
  });
}

}  // namespace

namespace {

/// \param palette  its values; empty: there is none
VoxelLayer exactLayerOf(const SparseVolume& volume, std::vector<float> palette) {
  VoxelLayer layer;
  layer.form = !palette.empty()    ? VoxelForm::kPalette
               : allHalves(volume) ? VoxelForm::kHalf
                                   : VoxelForm::kFloat;
  layer.palette = std::move(palette);
  fill(volume, RoundedSigns::kMayChange, layer);
  return layer;
}

std::uint64_t codedBytes(const VoxelLayer& layer) {
  return codec::bytesOfCodes(codec::chooseModel(layer), layer) +
         layer.palette.size() * sizeof(float);
}

}  // namespace

VoxelLayer exactLayer(const SparseVolume& volume) {
  return exactLayerOf(volume, paletteOf(volume));
}

VoxelLayer smallestExactLayer(const SparseVolume& volume) {
  VoxelLayer layer = exactLayer(volume);
  // A value of a palette takes four bytes. Where it is that of many voxels, a palette saves more.
  constexpr std::uint64_t kVoxelsOfAValue = 64;
  if (layer.palette.size() * kVoxelsOfAValue <= activeVoxelCount(volume)) return layer;
  VoxelLayer direct = exactLayerOf(volume, {});
  return codedBytes(direct) < codedBytes(layer) ? direct : layer;
}

// ---- Layers within a bound

namespace {

constexpr double kMargin = 1.0 - 1e-6;  // factor of a bound, which leaves room for rounding

double largestMagnitude(const SparseVolume& volume) {
  using Range = tbb::blocked_range<std::size_t>;
  const auto larger = [](float a, float b) { return std::max(a, b); };
  return parallelReduce(
      Range(0, volume.brickCount()), 0.0f,
      [&](const Range& bricks, float largest) {
        constexpr std::size_t kLanes = 8;  // as many as a SIMD vector has
        float lanes[kLanes] = {};
        for (std::size_t b = bricks.begin(); b != bricks.end(); ++b)
          for (std::size_t v = 0; v < kBrickVoxels; v += kLanes)
            for (std::size_t k = 0; k < kLanes; ++k)
              lanes[k] = larger(lanes[k], std::abs(volume.brickValues(b)[v + k]));
        return std::max(largest, *std::max_element(lanes, lanes + kLanes));
      },
      larger);
}

/// The largest error that rounding the values of a quantisation lattice to float32 adds.
double roundingError(const SparseVolume& volume, double bound) {
  return (largestMagnitude(volume) + bound) * 0x1p-24;
}

/// The largest bound on values before they are rounded to halfs. With it, the halfs usually keep to the
/// bound. Where halfs are u apart and the source's value is a half, a value that is d off is
/// off by a multiple of u after it is rounded, which exceeds the bound unless d is below
/// (floor(bound / u) + 1/2) u.
double boundBeforeRounding(const SparseVolume& volume, double bound) {
  constexpr int kMantissa = 10, kLowest = -14,
                kHighest = 15;  // a half has these bits and exponents
  const double largest = largestMagnitude(volume);
  // A value that is off by the bound may lie beyond the next power of 2, where halfs are farther apart.
  const int last =
      largest + bound > 0x1p-14 ? std::min(std::ilogb(largest + bound), kHighest) : kLowest;
  double before = bound;
  for (int exponent = kLowest; exponent <= last; ++exponent) {
    const double apart = std::ldexp(1.0, exponent - kMantissa);
    before = std::min(before, (std::floor(bound / apart) + 0.5) * apart);
  }
  return before;
}

/// The voxels of a volume, rounded to multiples of two half steps.
VoxelLayer quantised(const SparseVolume& volume, double halfStep, RoundedSigns signs) {
  VoxelLayer layer;
  layer.form = VoxelForm::kQuantised;
  layer.divisor = 0.5 / halfStep;
  fill(volume, signs, layer);
  return layer;
}

/// Removes the bricks that hold nothing but the background.
void dropVacant(VoxelLayer& layer) {
  std::size_t kept = 0;
  for (std::size_t b = 0; b < layer.bricks.size(); ++b) {
    if (layer.vacant[b].count() == kBrickVoxels) continue;
    const std::size_t to = kept++;
    if (to == b) continue;
    layer.bricks[to] = layer.bricks[b];
    layer.active[to] = layer.active[b];
    layer.vacant[to] = layer.vacant[b];
    std::copy_n(&layer.codes[b * kBrickVoxels], kBrickVoxels, &layer.codes[to * kBrickVoxels]);
  }
  layer.bricks.resize(kept);
  layer.active.resize(kept);
  layer.vacant.resize(kept);
  layer.codes.resize(kept * kBrickVoxels);
}

/// Clears the voxels of a brick outside a box. \param corner  its first voxel
void clip(const Box& box, Coord corner, BrickMask& mask) {
  constexpr int kLast = kBrickSide - 1;
  if (box.contains(corner) && box.contains(corner + Coord{kLast, kLast, kLast})) return;
  const BrickMask all = std::exchange(mask, {});
  for (int v = 0; v < kBrickVoxels; ++v)
    if (all.test(v) && box.contains(corner + voxelLocal(v))) mask.set(v);
}

/// Makes a voxel of each face of the active box active that would lose all of its active voxels.
void keepBox(const SparseVolume& volume, const Box& box, std::vector<BrickMask>& masks) {
  const unsigned lost = kAllFaces & ~touchedFaces(volume, box, masks);
  for (const Coord voxel : boxVoxels(volume, box, lost)) {
    const auto b = brickWith(volume, voxel);
    masks[*b].set(voxelOffset(localOf(voxel)));
  }
}

/// Lets the values decide which voxels of the active box are active: those that differ from the background by more than a
/// bound, and the few that keep the box. Of the others, those that do not differ from the background become vacant.
void activateByValue(const SparseVolume& volume, double bound, VoxelLayer& layer) {
  const Box box = activeBox(volume);
  const std::int32_t background = codec::codeOfValue(layer, volume.background);
  std::vector<BrickMask>& differs = layer.vacant;  // until the active voxels are known
  parallelFor(std::size_t{0}, volume.brickCount(), [&](std::size_t b) {
    differs[b] = differing(volume.brickValues(b), volume.background, bound);
    layer.active[b] = differs[b];
    clip(box, volume.brickCorner(b), layer.active[b]);
  });
  keepBox(volume, box, layer.active);
  parallelFor(std::size_t{0}, volume.brickCount(), [&](std::size_t b) {
    const std::span codes(&layer.codes[b * kBrickVoxels], std::size_t(kBrickVoxels));
    for (std::size_t w = 0; w < layer.vacant[b].words.size(); ++w)
      layer.vacant[b].words[w] = ~(layer.active[b].words[w] | differs[b].words[w]);
    for (int v = 0; v < kBrickVoxels; ++v)
      codes[std::size_t(v)] = layer.vacant[b].test(v) ? background : codes[std::size_t(v)];
  });
  dropVacant(layer);
}

/// The voxels of a volume on a lattice. \param bound  of the differences from the background of voxels that become inactive
VoxelLayer onLattice(const SparseVolume& volume, double halfStep, double bound, Activity activity,
                     RoundedSigns signs) {
  VoxelLayer layer = quantised(volume, halfStep, signs);
  if (activity == Activity::kByValue) activateByValue(volume, bound, layer);
  return layer;
}

/// The share of a bound that is half a step. A negative value near 0 that keeps its sign is up to a whole step off.
double shareOfBound(RoundedSigns signs) {
  return (signs == RoundedSigns::kKept ? 0.5 : 1.0) * kMargin;
}

void requireUsable(double bound) {
  if (!(std::isfinite(bound) && bound > 0.0))
    throw UsageError("the largest error must be above 0, not " + shortText(bound));
}

}  // namespace

VoxelLayer boundedLayer(const SparseVolume& volume, double bound, Activity activity,
                        RoundedSigns signs, DecodedValues decoded) {
  requireUsable(bound);
  const bool halfs = decoded == DecodedValues::kHalfs;
  // Multiples of twice the bound are nearly exact on the first lattice. Its values may miss the
  // bound where they are rounded to float32; the second lattice is finer and leaves room for that.
  // The half that is nearest to a code's value is at most twice as far from the source's half as this value, so that the last
  // lattice keeps the bound where values that lie on two sides of a power of 2 miss it.
  const double side = shareOfBound(signs);
  const double halfStep = side * (halfs ? boundBeforeRounding(volume, bound) : bound);
  std::vector<double> halfSteps{halfStep, halfStep - roundingError(volume, bound)};
  if (halfs) halfSteps.push_back(0.5 * side * bound);
  for (const double h : halfSteps) {
    if (!(h > 0.0)) break;
    VoxelLayer layer = onLattice(volume, h, side * bound, activity, signs);
    SparseVolume made = volumeOf(layer);
    if (halfs) roundToHalfs(made);
    if (largestDifference(volume, made) <= bound) return layer;
  }
  return exactLayer(volume);
}

VoxelLayer nearestLayer(const SparseVolume& volume, double bound, Activity activity,
                        RoundedSigns signs) {
  requireUsable(bound);
  const double halfStep = shareOfBound(signs) * bound;
  // float32 has no values between the steps of such a lattice.
  if (halfStep <= largestMagnitude(volume) * 0x1p-24) return exactLayer(volume);
  return onLattice(volume, halfStep, halfStep, activity, signs);
}

// ---- Layers that take fewer bits

namespace {

/// The voxels of a volume in units of the lattice, in the order of the layer's codes.
std::vector<double> placesOf(const SparseVolume& volume, const VoxelLayer& layer) {
  std::vector<double> places(layer.codes.size());
  parallelFor(std::size_t{0}, layer.bricks.size(), [&](std::size_t b) {
    const auto values = volume.brickValues(*findBrick(volume, layer.bricks[b]));
    double* place = &places[b * std::size_t(kBrickVoxels)];
    for (std::size_t v = 0; v < kBrickVoxels; ++v) place[v] = double(values[v]) * layer.divisor;
  });
  return places;
}

/// The bytes of all bricks, if a part of them took more than a limit.
std::optional<std::uint64_t> extrapolated(const codec::CodedPart& part, std::size_t bricks,
                                          std::uint64_t mostBytes) {
  if (part.bytes <= mostBytes) return std::nullopt;
  return std::uint64_t(double(part.bytes) * double(bricks) / double(part.bricks));
}

}  // namespace

ThriftyLayer thriftyLayer(const SparseVolume& volume, VoxelLayer layer,
                          const ThriftOptions& options) {
  if (layer.form != VoxelForm::kQuantised) return {std::move(layer)};
  if (options.previous && codec::isPredictable(layer, *options.previous)) {
    const codec::FrameThrift thrift{placesOf(volume, layer), options.bitPrice, options.steadiness,
                                    options.signs};
    codec::chooseFrameCodes(codec::codingOrder(layer.bricks),
                            codec::PastVoxels(*options.previous, layer), thrift, layer);
    return {std::move(layer)};
  }
  const codec::Thrift thrift{placesOf(volume, layer), options.bitPrice, options.signs,
                             options.massPrice};
  const codec::CodedPart part =
      codec::chooseCodes(codec::chooseModel(layer), thrift, options.mostBytes, layer);
  const auto tooMany = extrapolated(part, layer.bricks.size(), options.mostBytes);
  return {std::move(layer), tooMany};
}

}  // namespace esvr
