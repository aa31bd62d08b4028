#pragma once
/// The bricks of a fit on the device, found by their coordinates.
///
/// Target bricks are known from the start. Those that only supports reach come and go with the
/// ellipsoids: each rebuild finds them anew, and numbers them in increasing order of their
/// coordinates, so that numbers do not depend on the order in which threads found them.

#include <cstdint>
#include <span>

#include "fit/cuda/brick_table_view.h"
#include "fit/cuda/growing_buffer.h"
#include "fit/cuda/supports.h"

namespace esvr::cuda {

/// Every brick there is.
inline constexpr Box kAllBricks{{Box::kMin, Box::kMin, Box::kMin},
                                {Box::kMax, Box::kMax, Box::kMax}};

class BrickTable {
 public:
  BrickTable(std::span<const Coord> targetBricks, cudaStream_t stream);

  /// Finds the bricks beyond the target's that supports reach.
  /// \param within  bricks elsewhere are passed over
  void findReached(const SupportSource& supports, const Box& within = kAllBricks);
  /// Finds another table's bricks and their neighbours, in the place of those that supports reach.
  void findAround(const BrickTable& other, const Box& within = kAllBricks);

  [[nodiscard]] std::size_t targetCount() const { return targetCount_; }
  [[nodiscard]] std::size_t size() const { return targetCount_ + reachedCount_; }
  [[nodiscard]] BrickTableView view() const;

 private:
  void buildTargetTable();
  template <class Launch>
  void find(Launch&& launch);
  template <class Launch>
  [[nodiscard]] bool collect(Launch&& launch);
  void number();

  cudaStream_t stream_;
  std::size_t targetCount_, reachedCount_ = 0;
  GrowingBuffer<Coord> bricks_;  ///< target bricks, then those reached
  std::size_t slotCount_ = 0;
  GrowingBuffer<std::uint32_t> slots_;
  std::size_t reachedSlotCount_ = 0;
  GrowingBuffer<ReachedSlot> reachedSlots_;
  GrowingBuffer<std::uint32_t> counter_;
  GrowingBuffer<char> temporary_;
};

}  // namespace esvr::cuda
