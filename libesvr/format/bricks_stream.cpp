#include "format/bricks_stream.h"

#include <cstdint>

#include "core/axes.h"
#include "esvr/error.h"
#include "esvr/sparse_volume.h"
#include "format/byte_reader.h"
#include "format/byte_writer.h"

namespace esvr::format {
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

}  // namespace esvr::format
