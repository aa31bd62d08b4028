#pragma once
/// The bricks of a fit on the device, found by their coordinates.
///
/// Target bricks are known from the start. Those that only supports reach come and go with the
/// ellipsoids: each rebuild finds them anew, and numbers them in increasing order of their
/// coordinates, so that numbers do not depend on the order in which threads found them.

#include <bit>
#include <cstdint>
#include <span>

#include "core/cuda/growing_buffer.h"
#include "fit/cuda/brick_table_view.h"
#include "fit/cuda/supports.h"

namespace esvr::cuda {

/// Every brick that there can be.
inline constexpr Box kAllBricks{{Box::kMin, Box::kMin, Box::kMin},
                                {Box::kMax, Box::kMax, Box::kMax}};

/// Slots of a table that is to hold so many entries: it is at most half full, so that probes stay
/// short.
[[nodiscard]] inline std::size_t slotsFor(std::size_t entries) {
  return std::bit_ceil(2 * entries + 2);
}

class BrickTable {
 public:
  /// \throws DeviceError  there are more bricks than kernels can number
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
  void forgetReached();
  template <class Launch>
  void find(std::size_t expected, const Box& within, Launch&& launch);
  template <class Launch>
  [[nodiscard]] bool collect(const Box& within, Launch&& launch);
  void number();

  cudaStream_t stream_;
  std::size_t targetCount_, reachedCount_ = 0;
  Box targetBounds_, bounds_;    ///< in bricks
  GrowingBuffer<Coord> bricks_;  ///< target bricks, then those reached
  std::size_t slotCount_ = 0;
  GrowingBuffer<std::uint32_t> slots_;
  std::size_t reachedSlotCount_ = 0;
  GrowingBuffer<ReachedSlot> reachedSlots_;
  GrowingBuffer<std::uint32_t> counter_;
  GrowingBuffer<char> temporary_;
};

}  // namespace esvr::cuda
