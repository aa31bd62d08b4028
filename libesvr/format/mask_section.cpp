#include "format/mask_section.h"

#include <algorithm>
#include <utility>

#include "codec/frame_coder.h"
#include "codec/motion_search.h"
#include "esvr/error.h"
#include "format/bricks_stream.h"
#include "format/voxel_section.h"

namespace esvr::format {
namespace {

/// Positions of the bricks relative to the origin. Corners may be 2^32 voxels apart; as a number of
/// bricks this difference fits into 32 bits.
std::vector<Coord> bricksFrom(Coord origin, std::span<const Coord> corners) {
  std::vector<Coord> bricks;
  for (const Coord corner : corners) bricks.push_back(brickOf(corner) - brickOf(origin));
  return bricks;
}

BrickMask inverse(BrickMask mask) {
  for (auto& word : mask.words) word = ~word;
  return mask;
}

/// A mask as a layer with the codes 1 for active voxels and 0 for others, so that a frame is searched
/// for its motion.
VoxelLayer maskLayer(std::span<const Coord> bricks, std::span<const BrickMask> active) {
  VoxelLayer layer;
  layer.form = VoxelForm::kQuantised;
  layer.divisor = 1.0;
  layer.origin = bricks.empty() ? Coord{} : bricks.front();
  for (const Coord brick : bricks) layer.origin = minCoord(layer.origin, brick);
  layer.bricks = bricksFrom(layer.origin, bricks);
  layer.codes.resize(bricks.size() * kBrickVoxels);
  layer.active.assign(active.begin(), active.end());
  for (std::size_t i = 0; i < layer.codes.size(); ++i)
    layer.codes[i] = active[i / kBrickVoxels].test(int(i % kBrickVoxels)) ? 1 : 0;
  for (const BrickMask& mask : active) layer.vacant.push_back(inverse(mask));
  return layer;
}

Mask maskOf(VoxelLayer layer) {
  Mask mask;
  for (const Coord brick : layer.bricks) mask.bricks.push_back(layer.origin + brick * kBrickSide);
  mask.active = std::move(layer.active);
  return mask;
}

}  // namespace

/// Stores the mask as a voxel layer with one value, so that only the activity of voxels takes
/// bytes.
std::vector<std::byte> putMask(std::span<const Coord> bricks, std::span<const BrickMask> active) {
  requireBricks(bricks);
  if (bricks.size() != active.size()) throw RuntimeFailure("a mask without its bricks");
  VoxelLayer layer;
  layer.form = VoxelForm::kPalette;
  layer.palette = {0.0f};
  layer.origin = bricks.empty() ? Coord{} : bricks.front();
  for (const Coord brick : bricks) layer.origin = minCoord(layer.origin, brick);
  layer.bricks = bricksFrom(layer.origin, bricks);
  layer.codes.resize(bricks.size() * kBrickVoxels);
  layer.active.assign(active.begin(), active.end());
  for (const BrickMask& mask : active) layer.vacant.push_back(inverse(mask));
  return putVoxels(layer);
}

Mask getMask(std::span<const std::byte> content, const std::string& where, MemoryBudget& budget) {
  VoxelLayer layer = getVoxels(content, where, budget);
  if (layer.form != VoxelForm::kPalette || layer.palette.size() != 1)
    throw BadInput(where + ": a mask of voxels with values");
  return maskOf(std::move(layer));
}

std::vector<BrickMask> movedMask(const Mask& mask, const Mask& previous) {
  const VoxelLayer layer = maskLayer(mask.bricks, mask.active);
  const VoxelLayer before = maskLayer(previous.bricks, previous.active);
  if (!codec::isPredictable(layer, before)) return {};
  const codec::PastVoxels past(before, layer);
  codec::MotionSearch search(past);
  codec::PastCube<0> cube;
  std::vector<BrickMask> moved(mask.bricks.size());
  Coord motion;
  for (std::size_t b = 0; b < moved.size(); ++b) {
    const std::span codes(layer.codes);
    motion = search.find(layer.bricks[b], codes.subspan(b * kBrickVoxels, kBrickVoxels), motion);
    past.fill(layer.bricks[b], motion, cube);
    for (int v = 0; v < kBrickVoxels; ++v)
      if (cube.active[codec::PastCube<0>::cell(voxelLocal(v))]) moved[b].set(v);
  }
  return moved;
}

}  // namespace esvr::format
