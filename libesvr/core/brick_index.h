#pragma once
/// A hash table that finds bricks by their coordinates, and its hash, which tables on the device use as
/// well. The size of the table depends on the number of bricks only.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "esvr/ellipsoids.h"
#include "esvr/volume.h"

namespace esvr {

/// The hash of a brick's coordinates.
ESVR_HD inline std::uint64_t hashOf(Coord c) {
  std::uint64_t h = std::uint32_t(c.x) * 0x9e3779b97f4a7c15ull;
  h = (h ^ (h >> 29)) + std::uint32_t(c.y) * 0xbf58476d1ce4e5b9ull;
  h = (h ^ (h >> 32)) + std::uint32_t(c.z) * 0x94d049bb133111ebull;
  return h ^ (h >> 31);
}

/// The same as operator==, which nvcc 13 cannot call on the device if it is defaulted.
ESVR_HD inline bool sameBrick(Coord a, Coord b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

class BrickIndex {
 public:
  static constexpr std::uint32_t kNone = 0xffffffffu;

  /// \throws RuntimeFailure  there are 2^32 bricks or more; append() throws it too
  explicit BrickIndex(std::span<const Coord> bricks);

  /// Position of a brick, or kNone.
  [[nodiscard]] std::uint32_t find(Coord brick) const {
    for (std::size_t slot = hash(brick) & mask_;; slot = (slot + 1) & mask_) {
      if (slots_[slot] == kNone) return kNone;
      if (sameBrick(bricks_[slots_[slot]], brick)) return slots_[slot];
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
