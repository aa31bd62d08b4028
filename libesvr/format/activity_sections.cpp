// The sections that say where voxels are active.

#include "format/activity_sections.h"

#include <algorithm>
#include <cstdint>
#include <utility>

#include "core/geometry.h"
#include "esvr/error.h"
#include "format/bytes.h"
#include "format/voxel_section.h"

namespace esvr::format {

// ---- Positions of bricks

namespace {

constexpr std::size_t kBrickBytes = 3 * sizeof(std::int32_t);

constexpr std::int32_t kBrickMin = Box::kMin / kBrickSide, kBrickMax = Box::kMax / kBrickSide;

bool validSuccessor(Coord corner, const Coord* previous) {
  return localOf(corner) == Coord{} && (!previous || *previous < corner);
}

}  // namespace

void requireBricks(std::span<const Coord> corners) {
  for (std::size_t i = 0; i < corners.size(); ++i)
    if (!validSuccessor(corners[i], i == 0 ? nullptr : &corners[i - 1]))
      throw RuntimeFailure("brick corner " + toString(corners[i]) +
                           " is not a multiple of 8 or not above the one before it");
}

std::vector<std::byte> putBricks(std::span<const Coord> corners) {
  requireBricks(corners);
  ByteWriter out;
  for (const auto axis : kAxes)
    for (const Coord& corner : corners) out.put(brickOf(corner).*axis);
  return out.take();
}

std::vector<Coord> getBricks(std::span<const std::byte> content, const std::string& where) {
  ByteReader in(content, where);
  if (content.size() % kBrickBytes != 0) in.fail("not a whole number of bricks");
  std::vector<Coord> corners(content.size() / kBrickBytes);
  for (const auto axis : kAxes) {
    for (Coord& corner : corners) {
      const auto brick = in.get<std::int32_t>();
      if (brick < kBrickMin || brick > kBrickMax) in.fail("a brick lies outside the index space");
      corner.*axis = brick * kBrickSide;
    }
  }
  for (std::size_t i = 1; i < corners.size(); ++i)
    if (!(corners[i - 1] < corners[i])) in.fail("brick " + std::to_string(i) + " is out of order");
  return corners;
}

// ---- Masks

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

}  // namespace esvr::format
