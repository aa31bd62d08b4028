// Voxel layers for an encoder: exact ones, ones within a bound, and ones whose codes take fewer bits.

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <string>
#include <unordered_set>
#include <utility>

#include "codec/brick_coder.h"
#include "codec/frame_coder.h"
#include "codec/voxel_coder.h"
#include "codec/voxel_values.h"
#include "core/parallel.h"
#include "esvr/error.h"
#include "esvr/quantised.h"

namespace esvr {

// ---- The distance of two volumes

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

double largestError(const SparseVolume& volume, const VoxelLayer& layer) {
  return largestDifference(volume, volumeOf(layer));
}

// ---- Exact layers

namespace {

constexpr std::size_t kLargestPalette = 4096;

bool sameBits(float a, float b) {
  return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
}

/// The distinct values of a volume in increasing order; empty if there are too many for a palette.
std::vector<float> paletteOf(const SparseVolume& volume) {
  std::unordered_set<std::int32_t> orders;
  std::optional<std::int32_t> last;
  for (const float v : volume.values) {
    const std::int32_t order = codec::orderOfFloat(v);
    if (last == order) continue;
    orders.insert(*(last = order));
    if (orders.size() > kLargestPalette) return {};
  }
  std::vector<float> values;
  for (const std::int32_t order : orders) values.push_back(codec::floatAt(order));
  std::sort(values.begin(), values.end(), codec::inOrder);
  return values;
}

bool allHalves(const SparseVolume& volume) {
  return std::all_of(volume.values.begin(), volume.values.end(),
                     [](float v) { return sameBits(codec::halfAt(codec::orderOfHalf(v)), v); });
}

/// The code of a value. With kKept, the code of a negative value is negative.
std::int32_t roundedCode(const VoxelLayer& layer, float value, RoundedSigns signs) {
  const std::int32_t code = codec::codeOfValue(layer, value);
  return signs == RoundedSigns::kKept && value < 0.0f ? std::min(code, -1) : code;
}

void fill(const SparseVolume& volume, RoundedSigns signs, VoxelLayer& layer) {
  layer.origin = volume.origin;
  layer.background = volume.background;
  layer.bricks = volume.bricks;
  layer.active = volume.active;
  layer.vacant.resize(volume.brickCount());
  layer.codes = VoxelArray<std::int32_t>(volume.values.size(), memoryOf(volume));
  parallelFor(std::size_t{0}, volume.brickCount(), [&](std::size_t b) {
    const auto values = volume.brickValues(b);
    for (int v = 0; v < kBrickVoxels; ++v) {
      if (!volume.active[b].test(v) && sameBits(values[v], volume.background))
        layer.vacant[b].set(v);
      layer.codes[b * kBrickVoxels + std::size_t(v)] = roundedCode(layer, values[v], signs);
    }
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
  return codec::codeWithin(codec::chooseModel(layer), UINT64_MAX, layer).bytes +
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
  double largest = 0.0;
  for (const float v : volume.values) largest = std::max(largest, std::abs(double(v)));
  return largest;
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

/// The voxels that differ from the background by more than a bound.
std::vector<BrickMask> differing(const SparseVolume& volume, double bound) {
  std::vector<BrickMask> masks(volume.brickCount());
  parallelFor(std::size_t{0}, volume.brickCount(), [&](std::size_t b) {
    const auto values = volume.brickValues(b);
    for (int v = 0; v < kBrickVoxels; ++v)
      if (std::abs(double(values[v]) - volume.background) > bound) masks[b].set(v);
  });
  return masks;
}

/// Makes all voxels outside a box inactive.
void clip(const SparseVolume& volume, const Box& box, std::vector<BrickMask>& masks) {
  parallelFor(std::size_t{0}, masks.size(), [&](std::size_t b) {
    const BrickMask all = masks[b];
    masks[b] = {};
    for (int v = 0; v < kBrickVoxels; ++v)
      if (all.test(v) && box.contains(volume.brickCorner(b) + voxelLocal(v))) masks[b].set(v);
  });
}

/// Makes a voxel of each face of the active box active that would lose all of its active voxels.
void keepBox(const SparseVolume& volume, const Box& box, std::vector<BrickMask>& masks) {
  const unsigned lost = kAllFaces & ~touchedFaces(volume, box, masks);
  for (const Coord voxel : boxVoxels(volume, box, lost)) {
    const auto b = findBrick(volume, brickOf(voxel) - brickOf(volume.origin));
    masks[*b].set(voxelOffset(localOf(voxel)));
  }
}

/// Gives a layer these active voxels. Of the others, those that do not differ from the background
/// become vacant.
void activate(const SparseVolume& volume, const std::vector<BrickMask>& active,
              const std::vector<BrickMask>& differing, VoxelLayer& layer) {
  const std::int32_t background = codec::codeOfValue(layer, volume.background);
  parallelFor(std::size_t{0}, volume.brickCount(), [&](std::size_t b) {
    layer.active[b] = active[b];
    layer.vacant[b] = {};
    for (int v = 0; v < kBrickVoxels; ++v) {
      if (active[b].test(v) || differing[b].test(v)) continue;
      layer.vacant[b].set(v);
      layer.codes[b * kBrickVoxels + std::size_t(v)] = background;
    }
  });
  dropVacant(layer);
}

void activateByValue(const SparseVolume& volume, double bound, VoxelLayer& layer) {
  const auto differs = differing(volume, bound);
  auto active = differs;
  const Box box = activeBox(volume);
  clip(volume, box, active);
  keepBox(volume, box, active);
  activate(volume, active, differs, layer);
}

}  // namespace

VoxelLayer boundedLayer(const SparseVolume& volume, double bound, Activity activity,
                        RoundedSigns signs, DecodedValues decoded) {
  if (!(std::isfinite(bound) && bound > 0.0))
    throw UsageError("the largest error must be above 0, not " + std::to_string(bound));
  const bool halfs = decoded == DecodedValues::kHalfs;
  // Multiples of twice the bound are nearly exact on the first lattice. Its values may miss the
  // bound where they are rounded to float32; the second lattice is finer and leaves room for that.
  // A negative value near 0 that keeps its sign is up to a whole step off. The half that is nearest
  // to a code's value is at most twice as far from the source's half as this value, so that the last
  // lattice keeps the bound where values that lie on two sides of a power of 2 miss it.
  const double side = (signs == RoundedSigns::kKept ? 0.5 : 1.0) * kMargin;
  const double halfStep = side * (halfs ? boundBeforeRounding(volume, bound) : bound);
  std::vector<double> halfSteps{halfStep, halfStep - roundingError(volume, bound)};
  if (halfs) halfSteps.push_back(0.5 * side * bound);
  for (const double h : halfSteps) {
    if (!(h > 0.0)) break;
    VoxelLayer layer = quantised(volume, h, signs);
    if (activity == Activity::kByValue) activateByValue(volume, side * bound, layer);
    SparseVolume made = volumeOf(layer);
    if (halfs) roundToHalfs(made);
    if (largestDifference(volume, made) <= bound) return layer;
  }
  return exactLayer(volume);
}

// ---- Layers that take fewer bits

namespace {

/// The voxels of a volume in units of the lattice, in the order of the layer's codes.
std::vector<double> placesOf(const SparseVolume& volume, const VoxelLayer& layer) {
  std::vector<double> places(layer.codes.size());
  for (std::size_t b = 0; b < layer.bricks.size(); ++b) {
    throwIfCancelled();
    const auto values = volume.brickValues(*findBrick(volume, layer.bricks[b]));
    double* place = &places[b * std::size_t(kBrickVoxels)];
    for (std::size_t v = 0; v < kBrickVoxels; ++v) place[v] = double(values[v]) * layer.divisor;
  }
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
