#include "fit/chunks/chunks.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/geometry.h"
#include "fit/cuda/make_cuda.h"
#include "fit/tuning.h"

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

int haloBricks(std::uint64_t activeVoxels, std::size_t count) {
  constexpr double kScales = 2.0;  // largest scale, relative to the distance of ellipsoids
  constexpr int kFewest = 2;
  const double distance = std::cbrt(double(activeVoxels) / double(std::max<std::size_t>(count, 1)));
  const double scale = std::min(kScales * distance, Tuning{}.largestScale);
  const double radius = supportRadius(kernelConstants<double>(Kernel{}));
  return std::max(int(std::ceil(scale * radius / kBrickSide)), kFewest);
}

std::vector<std::uint32_t> bricksAround(const SparseVolume& volume,
                                        std::span<const BrickChunk> chunks, const BrickChunk& chunk,
                                        int halo) {
  const Box around = dilated(chunk.bounds, halo);
  std::vector<std::uint32_t> bricks;
  for (const BrickChunk& other : chunks) {
    if (common(around, other.bounds).empty()) continue;
    for (const std::uint32_t b : other.bricks)
      if (around.contains(volume.bricks[b])) bricks.push_back(b);
  }
  std::ranges::sort(bricks);
  return bricks;
}

// --- The chunks whose fits stay within the memory.

namespace {

/// Chunks for the memory of a GPU have at least this number of bricks; most bricks around a smaller
/// chunk would be its halo.
constexpr std::size_t kMinBricks = 512;

/// Room for the ellipsoids of chunks that get more than others, because their error is larger. With
/// 1.5, a fit of 549 million voxels filled the 4 GB that it was allowed (docs/scale.md).
constexpr double kSpare = 2.0;

// Memory of the host, measured with trees of 16 million voxels on a CPU: the target, the residual
// and the constants of a brick with its masks and lists; an ellipsoid with its moments, its
// gradient and its pairs.
constexpr double kHostBytesPerBrick = 4.0 * kBrickVoxels * sizeof(float);
constexpr double kHostBytesPerEllipsoid = 1024.0;

/// False if the fit of one chunk would take too much memory of the host.
bool fitsOnHost(const FitSize& size, std::size_t ellipsoids, const FitOptions& options) {
  return !options.maxHostBytes ||
         double(size.bricks) * kHostBytesPerBrick + double(ellipsoids) * kHostBytesPerEllipsoid <=
             double(*options.maxHostBytes);
}

bool isOnCpu(const FitOptions& options) { return options.device.kind == DeviceKind::kCpu; }

class MemoryCheck {
 public:
  MemoryCheck(const SparseVolume& volume, const FitOptions& options)
      : volume_(volume),
        options_(options),
        active_(activeVoxelCount(volume)),
        count_(plannedCount(options, active_)) {}

  /// True if the fit of every chunk stays within the memory of the host and of the GPU.
  [[nodiscard]] bool allFit(std::span<const BrickChunk> chunks) const {
    const double spare = chunks.size() > 1 ? kSpare : 1.0;
    return std::ranges::all_of(chunks, [&](const BrickChunk& chunk) {
      const FitSize size = sizeOf(chunks, chunk);
      const double share = double(size.activeVoxels) / double(active_);
      return fits(size, std::size_t(spare * share * double(count_)) + 1);
    });
  }

  /// True if the volume fits as one chunk with few ellipsoids.
  [[nodiscard]] bool bricksFit(std::span<const BrickChunk> whole) const {
    return fits(sizeOf(whole, whole.front()), 1);
  }

 private:
  [[nodiscard]] FitSize sizeOf(std::span<const BrickChunk> chunks, const BrickChunk& chunk) const {
    FitSize size;
    for (const std::uint32_t b :
         bricksAround(volume_, chunks, chunk, haloBricks(active_, count_))) {
      ++size.bricks;
      size.activeVoxels += std::uint64_t(volume_.active[b].count());
    }
    size.narrowBand = options_.narrowBand;
    size.constants = chunks.size() > 1;
    return size;
  }
  [[nodiscard]] bool fits(const FitSize& size, std::size_t ellipsoids) const {
    return fitsOnHost(size, ellipsoids, options_) &&
           (isOnCpu(options_) ||
            fitsOnGpu(size, ellipsoids, options_.device, options_.maxDeviceBytes));
  }

  const SparseVolume& volume_;
  const FitOptions& options_;
  std::uint64_t active_;
  std::size_t count_;
};

/// The bricks that have this number of active voxels on average.
std::size_t bricksWith(std::uint64_t voxels, const SparseVolume& volume) {
  const double each = double(activeVoxelCount(volume)) / double(volume.brickCount());
  return std::size_t(std::min(double(voxels) / each, double(volume.brickCount())));
}

}  // namespace

std::vector<BrickChunk> chunksFor(const SparseVolume& volume, const FitOptions& options) {
  if (options.chunkVoxels) return divideBricks(volume, bricksWith(*options.chunkVoxels, volume));
  if (isOnCpu(options) && !options.maxHostBytes) return {};
  const MemoryCheck memory(volume, options);
  const auto whole = divideBricks(volume, volume.brickCount());
  auto chunks = whole;
  for (std::size_t most = volume.brickCount(); !memory.allFit(chunks);) {
    most /= 2;
    // Where even small chunks do not fit, a fit in one chunk with fewer ellipsoids is better.
    if (most < kMinBricks) return memory.bricksFit(whole) ? whole : chunks;
    chunks = divideBricks(volume, most);
  }
  return chunks;
}

// --- The ellipsoids of each chunk.

namespace {

/// The error falls as n^-p.
const double kPower = 0.1 * kDbPerDoubling / std::log10(2.0);

/// A number to which the best number of ellipsoids is proportional. With E = a n^-p, dE/dn is the
/// same for all chunks if n is proportional to a^(1 / (p + 1)).
double weightOf(const ChunkNeed& need) {
  const double a = need.error * std::pow(need.count, kPower);
  return std::pow(a, 1.0 / (kPower + 1.0));
}

std::size_t within(const ChunkNeed& need, double number) {
  const double bounded = std::clamp(number, double(need.least), double(need.most));
  return std::size_t(std::floor(bounded));
}

/// The numbers at a factor of the weights, within the limits.
std::vector<std::size_t> numbersAt(double factor, std::span<const ChunkNeed> needs) {
  std::vector<std::size_t> numbers;
  for (const ChunkNeed& need : needs) numbers.push_back(within(need, factor * weightOf(need)));
  return numbers;
}

std::size_t sumOf(std::span<const std::size_t> numbers) {
  std::size_t sum = 0;
  for (const std::size_t n : numbers) sum += n;
  return sum;
}

}  // namespace

std::vector<std::size_t> dividedCount(std::size_t count, std::span<const ChunkNeed> needs) {
  double low = 0.0, high = 0.0;  // factors of the weights
  for (const ChunkNeed& need : needs)
    if (const double weight = weightOf(need); weight > 0.0)
      high = std::max(high, double(count) / weight);
  constexpr int kHalvings = 60;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (sumOf(numbersAt(middle, needs)) <= count ? low : high) = middle;
  }
  std::vector<std::size_t> numbers = numbersAt(low, needs);
  // Rounding down leaves less than one ellipsoid a chunk.
  std::size_t left = count - std::min(count, sumOf(numbers));
  for (std::size_t c = 0; c < needs.size() && left > 0; ++c) {
    if (numbers[c] >= needs[c].most || !(needs[c].error > 0.0)) continue;
    ++numbers[c];
    --left;
  }
  return numbers;
}

}  // namespace esvr
