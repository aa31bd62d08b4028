#include "fit/chunks/chunks_for.h"

#include <algorithm>
#include <cstdint>
#include <span>

#include "fit/chunks/chunk_target.h"
#include "fit/cuda/make_cuda_optimiser.h"

namespace esvr {
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

}  // namespace esvr
