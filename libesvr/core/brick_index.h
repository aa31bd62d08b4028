#pragma once
/// A hash table that finds bricks by their coordinates. Its size depends on the number of bricks
/// only.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/brick_hash.h"
#include "esvr/coord.h"

namespace esvr {

class BrickIndex {
 public:
  static constexpr std::uint32_t kNone = 0xffffffffu;

  /// \throws RuntimeFailure  there are 2^32 bricks or more; append() throws it too
  explicit BrickIndex(std::span<const Coord> bricks);

  /// Position of a brick, or kNone.
  [[nodiscard]] std::uint32_t find(Coord brick) const {
    for (std::size_t slot = hash(brick) & mask_;; slot = (slot + 1) & mask_) {
      if (slots_[slot] == kNone) return kNone;
      if (bricks_[slots_[slot]] == brick) return slots_[slot];
    }
  }
  /// Appends those of the bricks that are not in the table.
  void append(std::span<const Coord> bricks);

  [[nodiscard]] const std::vector<Coord>& bricks() const { return bricks_; }
  [[nodiscard]] std::size_t size() const { return bricks_.size(); }
  /// The smallest box of brick coordinates that contains all bricks.
  [[nodiscard]] const Box& bounds() const { return bounds_; }

 private:
  static std::size_t hash(Coord c) { return std::size_t(hashOf(c)); }
  void add(std::span<const Coord> bricks);
  void insert(std::uint32_t position);
  void rehash();

  std::vector<Coord> bricks_;
  Box bounds_;
  std::vector<std::uint32_t> slots_;
  std::size_t mask_ = 0;
};

}  // namespace esvr
