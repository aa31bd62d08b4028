#include "format/level_section.h"

#include <algorithm>
#include <utility>

#include "codec/brick_coder.h"
#include "codec/level_coder.h"
#include "esvr/error.h"
#include "format/bricks_stream.h"
#include "format/byte_reader.h"
#include "format/byte_writer.h"

namespace esvr::format {
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
