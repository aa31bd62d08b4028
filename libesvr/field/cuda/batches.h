#pragma once
/// Splits bricks so that what one launch needs stays within a bound.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace esvr::cuda {

/// Bricks [begin, end).
struct Batch {
  std::size_t begin, end;

  friend bool operator==(const Batch&, const Batch&) = default;
};

/// What a brick and each of its pairs cost.
struct BrickCost {
  std::size_t perBrick, perPair;
};

/// Batches in order, each as long as `bound` allows; a brick that alone exceeds it is a batch.
/// \param brickBegin  bricks + 1: range of a brick's pairs
[[nodiscard]] std::vector<Batch> splitIntoBatches(std::span<const std::uint32_t> brickBegin,
                                                  BrickCost cost, std::size_t bound);

}  // namespace esvr::cuda
