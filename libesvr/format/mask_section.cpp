#include "format/mask_section.h"

#include <algorithm>

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
  Mask mask;
  for (const Coord brick : layer.bricks) mask.bricks.push_back(layer.origin + brick * kBrickSide);
  mask.active = std::move(layer.active);
  return mask;
}

}  // namespace esvr::format
