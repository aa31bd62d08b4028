#include "vdb/brick_filler.h"

#include <limits>
#include <string>

#include "esvr/error.h"
#include "esvr/memory_limit.h"

namespace esvr::vdb {
namespace {

/// Bytes of a brick's voxels, and of its other entries in the volume and in the list of sources.
constexpr double kValueBytes = kBrickVoxels * sizeof(float);
constexpr double kEntryBytes = sizeof(BrickMask) + 2.0 * sizeof(Coord) + 32.0;

void refuseTooFarApart(Coord low, Coord high) {
  constexpr std::int64_t kMaxExtent = std::numeric_limits<std::int32_t>::max() - kBrickSide;
  const std::int64_t extent = std::max(
      {std::int64_t(high.x) - low.x, std::int64_t(high.y) - low.y, std::int64_t(high.z) - low.z});
  if (extent > kMaxExtent)
    throw BadInput("its active voxels reach from " + toString(low) + " to " + toString(high) +
                   ": 2^31 voxels or more");
}

}  // namespace

float narrowBackground(double background) {
  const auto narrow = float(background);
  if (!std::isfinite(narrow))
    throw BadInput("its background, " + std::to_string(background) + ", is not a finite float");
  return narrow;
}

void refuseTooLarge(std::uint64_t bricks, std::uint64_t treeBytes, const ReadOptions& options) {
  const bool isInFile = options.memory.isInFile(bricks * std::uint64_t(kValueBytes));
  const double each = kEntryBytes + (isInFile ? 0.0 : kValueBytes);
  requireWithinMemory(
      double(treeBytes) + double(bricks) * each, options.maxBytes,
      "it has " + std::to_string(bricks) + " bricks of 8^3 voxels, active tiles included, and");
}

void refuseNonFinite(const NonFiniteTally& tally, NonFinite nonFinite) {
  if (tally.count == 0 || nonFinite == NonFinite::kZero) return;
  throw BadInput(std::to_string(tally.count) + (tally.count == 1 ? " voxel is" : " voxels are") +
                 " NaN, infinite or too large for float; the first is at " + toString(tally.first));
}

void refuseEmpty(std::size_t bricks, const FillRules& rules) {
  if (bricks == 0 && !rules.allowEmpty) throw BadInput("it has no active voxel");
}

SparseVolume layOutBricks(const std::vector<Coord>& corners, float background,
                          const VoxelMemory& memory) {
  SparseVolume volume;
  volume.background = background;
  if (corners.empty()) return volume;
  Coord low = corners.front(), high = low;
  for (const Coord corner : corners) {
    low = minCoord(low, corner);
    high = maxCoord(high, corner);
  }
  refuseTooFarApart(low, high);
  volume.origin = low;
  volume.bricks.reserve(corners.size());
  for (const Coord corner : corners) {
    const Coord place = brickOf(corner - low);
    if (!volume.bricks.empty() && volume.bricks.back() == place)
      throw BadInput("it has two bricks at " + toString(corner));
    volume.bricks.push_back(place);
  }
  volume.values = VoxelArray<float>(corners.size() * kBrickVoxels, background, memory);
  volume.active.resize(corners.size());
  return volume;
}

}  // namespace esvr::vdb
