#include "fit/chunks/chunks_for.h"

#include <algorithm>
#include <cstdint>
#include <limits>

#include "fit/chunks/chunk_target.h"
#include "fit/cuda/make_cuda_optimiser.h"

namespace esvr {
namespace {

/// Chunks are not made smaller than this number of active voxels; most of a smaller chunk's bricks
/// would be its halo.
constexpr std::uint64_t kMinVoxels = std::uint64_t{1} << 16;

/// True if the fit of a chunk stays within the memory of the GPU.
bool fits(const SparseVolume& volume, const FitOptions& options, std::span<const BrickChunk> chunks,
          const BrickChunk& chunk) {
  const std::uint64_t all = activeVoxelCount(volume);
  const std::size_t whole = plannedCount(options, all);
  FitSize size;
  for (const std::uint32_t b : bricksAround(volume, chunks, chunk, haloBricks(all, whole))) {
    ++size.bricks;
    size.activeVoxels += std::uint64_t(volume.active[b].count());
  }
  size.narrowBand = options.narrowBand;
  size.between = options.fitFor == FitFor::kDrawing;
  size.constants = chunk.bricks.size() < volume.brickCount();
  const double share = double(size.activeVoxels) / double(all);
  const auto count = std::size_t(share * double(whole)) + 1;
  return fitsOnGpu(size, count, options.device, options.maxDeviceBytes);
}

}  // namespace

std::vector<BrickChunk> chunksFor(const SparseVolume& volume, const FitOptions& options) {
  const bool onCpu = options.device.kind == DeviceKind::kCpu;
  if (onCpu && !options.chunkVoxels) return {};
  std::uint64_t most = options.chunkVoxels.value_or(std::numeric_limits<std::uint64_t>::max());
  auto chunks = divideBricks(volume, most);
  if (options.chunkVoxels) return chunks;
  const auto fitting = [&](const BrickChunk& chunk) {
    return fits(volume, options, chunks, chunk);
  };
  most = activeVoxelCount(volume);
  while (most > kMinVoxels && !std::all_of(chunks.begin(), chunks.end(), fitting)) {
    most /= 2;
    chunks = divideBricks(volume, most);
  }
  return chunks;
}

}  // namespace esvr
