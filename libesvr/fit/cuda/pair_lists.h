#pragma once
/// The pair lists on the device: the ellipsoids of each brick, and the bricks of each
/// ellipsoid.

#include <cstdint>

#include "fit/cuda/brick_table.h"

namespace esvr::cuda {

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
