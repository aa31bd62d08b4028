#pragma once
/// Which ellipsoids reach which bricks, listed both ways on the device.

#include <cstdint>

#include "fit/cuda/brick_table.h"

namespace esvr::cuda {

/// An ellipsoid's pairs are numbered one after the other, in the bricks' order; moments are kept
/// under these numbers, so that an ellipsoid's own lie side by side. An ellipsoid's pairs are summed
/// in chunks, so that one which covers half the volume does not keep its thread for long.
struct PairListsView {
  static constexpr std::uint32_t kChunk = 256;  ///< pairs

  const std::uint32_t* brickOrder;      ///< bricks, those with the most pairs first
  const std::uint32_t* brickBegin;      ///< bricks + 1: range of a brick's entries
  const std::uint32_t* ellipsoid;       ///< an entry's; those with the most lines first
  const std::uint32_t* pair;            ///< an entry's number among the ellipsoids' pairs
  const std::uint32_t* ellipsoidBegin;  ///< ellipsoids + 1: range of an ellipsoid's pairs
  const std::uint32_t* chunkBegin;      ///< ellipsoids + 1: range of an ellipsoid's chunks
  const std::uint32_t* chunkOwner;      ///< a chunk's ellipsoid
};

class PairLists {
 public:
  explicit PairLists(cudaStream_t stream);

  /// \throws DeviceError  2^32 pairs or more, 2^29 bricks or more
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
  GrowingBuffer<std::uint32_t> brickBegin_, brickPairs_, brickPairsSorted_, bricks_, brickOrder_;
  GrowingBuffer<std::uint64_t> total_;
  GrowingBuffer<char> temporary_;
};

}  // namespace esvr::cuda
