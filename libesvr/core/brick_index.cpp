#include "core/brick_index.h"

#include <bit>

#include "esvr/error.h"

namespace esvr {

BrickIndex::BrickIndex(std::span<const Coord> bricks) {
  add(bricks);
  rehash();
}

void BrickIndex::add(std::span<const Coord> bricks) {
  if (bricks_.size() + bricks.size() >= kNone)
    throw RuntimeFailure("there are 2^32 bricks or more");
  bricks_.insert(bricks_.end(), bricks.begin(), bricks.end());
  for (const Coord brick : bricks) bounds_.expand(brick);
}

void BrickIndex::append(std::span<const Coord> bricks) {
  const std::size_t first = bricks_.size();
  add(bricks);
  if (2 * bricks_.size() > slots_.size()) return rehash();
  for (std::size_t b = first; b < bricks_.size(); ++b) insert(std::uint32_t(b));
}

void BrickIndex::insert(std::uint32_t position) {
  std::size_t slot = hash(bricks_[position]) & mask_;
  while (slots_[slot] != kNone) slot = (slot + 1) & mask_;
  slots_[slot] = position;
}

void BrickIndex::rehash() {
  slots_.assign(std::bit_ceil(4 * bricks_.size() + 8), kNone);
  mask_ = slots_.size() - 1;
  for (std::size_t b = 0; b < bricks_.size(); ++b) insert(std::uint32_t(b));
}

}  // namespace esvr
