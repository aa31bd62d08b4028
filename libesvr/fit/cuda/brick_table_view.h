#pragma once
/// A BrickTable as kernels use it, and look-ups in it.

#include <cstdint>

#include "core/brick_hash.h"

namespace esvr::cuda {

inline constexpr std::uint32_t kNoBrick = 0xffffffffu;

/// A slot of the table of reached bricks. Many threads fill the table at the same time.
struct ReachedSlot {
  enum State : int { kEmpty = 0, kBeingWritten = 1, kReady = 2 };
  int state;
  Coord brick;
  std::uint32_t number;
};

/// The tables use open addressing with linear probing. Their numbers of slots are powers of two.
struct BrickTableView {
  const Coord* bricks;
  const std::uint32_t* slots;  ///< numbers of target bricks
  std::uint32_t mask;          ///< slots - 1
  const ReachedSlot* reachedSlots;
  std::uint32_t reachedMask;
  bool anyReached;
  Box bounds;  ///< contains all bricks

#if defined(__CUDACC__)
  /// Number of a brick; kNoBrick if the table does not have it.
  __device__ std::uint32_t find(Coord brick) const {
    const auto hash = std::uint32_t(hashOf(brick));
    const std::uint32_t target = findTarget(brick, hash);
    return target != kNoBrick || !anyReached ? target : findReached(brick, hash);
  }
  __device__ std::uint32_t findTarget(Coord brick, std::uint32_t hash) const {
    for (std::uint32_t s = hash & mask;; s = (s + 1) & mask) {
      const std::uint32_t number = slots[s];
      if (number == kNoBrick || sameBrick(bricks[number], brick)) return number;
    }
  }

 private:
  __device__ std::uint32_t findReached(Coord brick, std::uint32_t hash) const {
    for (std::uint32_t s = hash & reachedMask;; s = (s + 1) & reachedMask) {
      const ReachedSlot& slot = reachedSlots[s];
      if (slot.state == ReachedSlot::kEmpty) return kNoBrick;
      if (sameBrick(slot.brick, brick)) return slot.number;
    }
  }
#endif
};

}  // namespace esvr::cuda
