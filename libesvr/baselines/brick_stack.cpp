#include "baselines/brick_stack.h"

#include <algorithm>

#include "esvr/error.h"

namespace esvr::baselines {
namespace {

constexpr unsigned kDigitBits = 7;
constexpr std::uint64_t kDigitMask = (1u << kDigitBits) - 1, kMore = 1u << kDigitBits;

/// Appends a number in digits of 7 bits; all but the last one have the highest bit.
void append(std::uint64_t number, std::vector<std::byte>& bytes) {
  for (; number > kDigitMask; number >>= kDigitBits)
    bytes.push_back(std::byte(kMore | (number & kDigitMask)));
  bytes.push_back(std::byte(number));
}

std::uint64_t take(std::span<const std::byte>& bytes) {
  std::uint64_t number = 0;
  for (unsigned shift = 0; shift < 64 && !bytes.empty(); shift += kDigitBits) {
    const auto digit = std::uint64_t(bytes.front());
    bytes = bytes.subspan(1);
    number |= (digit & kDigitMask) << shift;
    if (digit < kMore) return number;
  }
  throw BadInput("the positions of bricks end too early");
}

/// The number that stands for a brick in another column, where the gap along z has no meaning.
constexpr std::uint64_t kOtherColumn = 0;

}  // namespace

Box StackShape::box() const {
  return {{}, {kBrickSide - 1, int(rows) * kBrickSide - 1, int(length) * kBrickSide - 1}};
}

StackShape stackShape(std::size_t bricks) {
  constexpr std::size_t kMaxLength = 65536 / kBrickSide;
  const std::size_t rows = std::max<std::size_t>(1, (bricks + kMaxLength - 1) / kMaxLength);
  return {rows, (bricks + rows - 1) / rows};
}

SparseVolume stackBricks(const SparseVolume& volume) {
  SparseVolume stack = volume;
  stack.origin = {};
  const std::size_t length = stackShape(stack.brickCount()).length;
  for (std::size_t b = 0; b < stack.brickCount(); ++b)
    stack.bricks[b] = {0, int(b / length), int(b % length)};
  return stack;
}

SparseVolume unstackBricks(const SparseVolume& stack, std::span<const Coord> bricks, Coord origin) {
  SparseVolume volume = stack;
  volume.origin = origin;
  const std::size_t length = stackShape(bricks.size()).length;
  for (auto& brick : volume.bricks) brick = bricks[brick.y * length + brick.z];
  return volume;
}

std::vector<std::byte> encodeBricks(std::span<const Coord> bricks) {
  std::vector<std::byte> bytes;
  append(bricks.size(), bytes);
  Coord before{0, 0, -1};
  for (const Coord brick : bricks) {
    if (brick.x == before.x && brick.y == before.y) {
      append(std::uint64_t(brick.z - before.z), bytes);
    } else {
      append(kOtherColumn, bytes);
      for (const int place : {brick.x, brick.y, brick.z}) append(std::uint64_t(place), bytes);
    }
    before = brick;
  }
  return bytes;
}

std::vector<Coord> decodeBricks(std::span<const std::byte>& bytes) {
  const std::uint64_t count = take(bytes);
  if (count > bytes.size()) throw BadInput("the positions of bricks end too early");
  std::vector<Coord> bricks(count);
  Coord before{0, 0, -1};
  for (auto& brick : bricks) {
    const std::uint64_t gap = take(bytes);
    brick = before;
    if (gap != kOtherColumn)
      brick.z += int(gap);
    else
      for (int* place : {&brick.x, &brick.y, &brick.z}) *place = int(take(bytes));
    before = brick;
  }
  return bricks;
}

}  // namespace esvr::baselines
