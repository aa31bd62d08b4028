// The sections that say where voxels are active.

#include "format/activity_sections.h"

#include <algorithm>
#include <cstdint>
#include <utility>

#include "codec/brick_coder.h"
#include "codec/level_coder.h"
#include "codec/past_voxels.h"
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

// ---- Levels

namespace {

/// Largest number of bricks for each byte of a section, so that a small section cannot ask for much
/// memory.
constexpr std::uint64_t kMostBricksOfByte = 64;
/// Memory that a reader takes for a brick: its levels, its position, and their places in lists.
constexpr double kReaderBytesOfBrick = 128.0;

/// The smallest coordinates of bricks, in bricks; (0, 0, 0) without bricks.
Coord firstOf(std::span<const Coord> corners) {
  Coord first = corners.empty() ? Coord{} : brickOf(corners.front());
  for (const Coord corner : corners) first = minCoord(first, brickOf(corner));
  return first;
}

/// Levels with the positions of their bricks relative to a brick.
codec::LevelBricks relativeTo(Coord first, const Levels& levels) {
  codec::LevelBricks result{{}, levels.levels};
  for (const Coord corner : levels.bricks) result.bricks.push_back(brickOf(corner) - first);
  return result;
}

void requireCodable(const Levels& levels) {
  requireBricks(levels.bricks);
  if (levels.bricks.size() != levels.levels.size())
    throw RuntimeFailure("levels without their bricks");
  if (!areNear(levels.bricks)) throw RuntimeFailure("bricks with levels lie too far apart");
}

/// Index coordinate of a brick's first voxel. \param first, brick  in bricks
std::int32_t cornerOf(std::int32_t first, std::int32_t brick, const ByteReader& in) {
  const std::int64_t corner = (std::int64_t{first} + brick) * kBrickSide;
  if (corner < Box::kMin || corner > Box::kMax - kBrickSide)
    in.fail("a brick lies beyond the index space");
  return std::int32_t(corner);
}

}  // namespace

bool areNear(std::span<const Coord> corners) {
  const Coord first = firstOf(corners);
  return std::ranges::all_of(corners, [&](Coord c) { return codec::isInside(brickOf(c) - first); });
}

std::vector<std::byte> putLevels(const Levels& levels) {
  requireCodable(levels);
  const Coord first = firstOf(levels.bricks);
  codec::Writer side;
  codec::codeLevels(side, relativeTo(first, levels));
  ByteWriter out;
  for (const auto start : {first.x, first.y, first.z}) out.put(start);
  auto stream = side.coder.finish();
  const std::uint64_t least = (levels.bricks.size() + kMostBricksOfByte - 1) / kMostBricksOfByte;
  stream.resize(std::max<std::uint64_t>(stream.size(), least));
  out.putAll(stream);
  return out.take();
}

Levels getLevels(std::span<const std::byte> content, const std::string& where,
                 MemoryBudget& budget) {
  ByteReader in(content, where);
  Coord first;
  for (std::int32_t* start : {&first.x, &first.y, &first.z}) *start = in.get<std::int32_t>();
  const auto stream = in.getBytes(in.left());
  const std::uint64_t maxBricks = kMostBricksOfByte * stream.size();
  budget.take(kReaderBytesOfBrick * double(maxBricks), where);
  codec::Reader side{codec::RangeDecoder(stream)};
  Levels levels;
  try {
    codec::LevelBricks read = codec::codeLevels(side, maxBricks);
    levels.levels = std::move(read.levels);
    for (const Coord b : read.bricks)
      levels.bricks.push_back(
          {cornerOf(first.x, b.x, in), cornerOf(first.y, b.y, in), cornerOf(first.z, b.z, in)});
  } catch (const BadInput& error) {
    in.fail(error.what());
  }
  return levels;
}

}  // namespace esvr::format
