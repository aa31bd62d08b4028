#pragma once
/// The bricks of a fit and its pair lists on the device: the ellipsoids of each brick, and the
/// bricks of each ellipsoid.

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/brick_index.h"
#include "core/cuda/device_buffer.h"
#include "field/support.h"
#include "fit/ellipsoid.h"
#include "fit/motion_bound.h"

namespace esvr::cuda {

/// The supports of ellipsoids for the kernels that build lists. All pointers are to device memory
/// that the caller owns.
struct SupportSource {
  const Ellipsoid* ellipsoids;
  std::size_t count;
  double radius;                  ///< radius of the supports in the unit frame
  double slack;                   ///< voxels by which supports are widened
  const double* radii = nullptr;  ///< radius of each support; null: all have `radius`
  /// If it is not null, it is read instead of `ellipsoids` and `radii`.
  const ListedSupport* listed = nullptr;

  [[nodiscard]] ESVR_HD double radiusOf(std::size_t i) const {
    return radii != nullptr ? radii[i] : radius;
  }
  [[nodiscard]] ESVR_HD Support supportOf(std::size_t i) const {
    if (listed != nullptr)
      return makeSupport(listed[i].center, listed[i].L, listed[i].reach, slack);
    return makeSupport(ellipsoids[i].center, ellipsoids[i].L, radiusOf(i), slack);
  }
};

/// \return the bricks of `within` that the support's bounding box overlaps; empty if there are
///         none. The limit keeps the search short for a support that is larger than the volume.
[[nodiscard]] ESVR_HD inline Box clippedRange(const Support& support, const Box& within) {
  const Box range = brickRange(support);
  const auto larger = [](std::int32_t a, std::int32_t b) { return a > b ? a : b; };
  const auto smaller = [](std::int32_t a, std::int32_t b) { return a < b ? a : b; };
  return {{larger(range.min.x, within.min.x), larger(range.min.y, within.min.y),
           larger(range.min.z, within.min.z)},
          {smaller(range.max.x, within.max.x), smaller(range.max.y, within.max.y),
           smaller(range.max.z, within.max.z)}};
}

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

/// A box that contains every brick.
inline constexpr Box kAllBricks{{Box::kMin, Box::kMin, Box::kMin},
                                {Box::kMax, Box::kMax, Box::kMax}};

/// Number of slots for a table with this number of entries. The table is at most half full, which
/// keeps probes short.
[[nodiscard]] inline std::size_t slotsFor(std::size_t entries) {
  return std::bit_ceil(2 * entries + 2);
}

/// A hash table of the bricks of a fit. Target bricks are known from the start. Other bricks that
/// supports reach change with the ellipsoids. Each rebuild finds them again and numbers them in
/// increasing order of their coordinates, so that the numbers do not depend on the order in which
/// threads found them.
class BrickTable {
 public:
  /// \throws DeviceError  there are more bricks than kernels can number
  BrickTable(std::span<const Coord> targetBricks, cudaStream_t stream);

  /// Finds the bricks that supports reach and that are not target bricks.
  /// \param within  bricks outside this box are ignored
  void findReached(const SupportSource& supports, const Box& within = kAllBricks);
  /// Takes the bricks of another table and their neighbours as the reached bricks.
  void findAround(const BrickTable& other, const Box& within = kAllBricks);

  [[nodiscard]] std::size_t targetCount() const { return targetCount_; }
  [[nodiscard]] std::size_t size() const { return targetCount_ + reachedCount_; }
  [[nodiscard]] BrickTableView view() const;

 private:
  void forgetReached();
  template <class Launch>
  void find(std::size_t expected, const Box& within, Launch&& launch);
  template <class Launch>
  [[nodiscard]] bool collect(const Box& within, Launch&& launch);
  void number();

  cudaStream_t stream_;
  std::size_t targetCount_, reachedCount_ = 0;
  Box targetBounds_, bounds_;    ///< boxes of brick coordinates
  GrowingBuffer<Coord> bricks_;  ///< target bricks, then reached bricks
  std::size_t slotCount_ = 0;
  GrowingBuffer<std::uint32_t> slots_;
  std::size_t reachedSlotCount_ = 0;
  GrowingBuffer<ReachedSlot> reachedSlots_;
  GrowingBuffer<std::uint32_t> counter_;
  GrowingBuffer<char> temporary_;
};

/// The pairs of an ellipsoid have consecutive numbers, in the order of the bricks. Moments are
/// stored by these numbers, so that those of an ellipsoid lie next to each other. They are summed
/// in chunks, because an ellipsoid that covers half the volume would take one thread too long.
struct PairListsView {
  static constexpr std::uint32_t kChunk = 256;  ///< pairs in a chunk

  /// Bricks in roughly decreasing order of their number of pairs. Those with a power of two or more
  /// come before those with fewer.
  const std::uint32_t* brickOrder;
  const std::uint32_t* brickBegin;      ///< by brick: its entries are [b] to [b + 1] - 1
  const std::uint32_t* ellipsoid;       ///< by entry: its ellipsoid; in a brick by decreasing lines
  const std::uint32_t* pair;            ///< by entry: number of its pair
  const std::uint32_t* ellipsoidBegin;  ///< by ellipsoid: its pairs are [i] to [i + 1] - 1
  const std::uint32_t* chunkBegin;      ///< by ellipsoid: its chunks are [i] to [i + 1] - 1
  const std::uint32_t* chunkOwner;      ///< by chunk: its ellipsoid
};

class PairLists {
 public:
  explicit PairLists(cudaStream_t stream);

  /// \throws DeviceError  there are 2^32 pairs or more, or 2^29 bricks or more
  void rebuild(const SupportSource& supports, const BrickTable& bricks);

  [[nodiscard]] std::size_t pairCount() const { return pairCount_; }
  [[nodiscard]] std::size_t chunkCount() const { return chunkCount_; }
  [[nodiscard]] PairListsView view() const;

 private:
  void countPairs(const SupportSource& supports, const BrickTableView& bricks);
  void readTotals(std::size_t ellipsoids);
  void listPairs(const SupportSource& supports, const BrickTableView& bricks);
  void sortByBrick(std::size_t bricks);
  void orderBricks(std::size_t bricks);

  cudaStream_t stream_;
  std::size_t pairCount_ = 0, chunkCount_ = 0;
  GrowingBuffer<std::uint32_t> counts_, chunkCounts_, ellipsoidBegin_, chunkBegin_, chunkOwner_;
  GrowingBuffer<std::uint32_t> key_, keySorted_, pair_, pairSorted_, owner_, ellipsoid_;
  GrowingBuffer<std::uint32_t> brickBegin_, brickRank_, brickRankSorted_, bricks_, brickOrder_;
  GrowingBuffer<std::uint64_t> total_;
  GrowingBuffer<char> temporary_;
};

}  // namespace esvr::cuda
