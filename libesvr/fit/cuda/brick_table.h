#pragma once
/// A hash table of the bricks of a fit on the device.
///
/// Target bricks are known from the start. Other bricks that supports reach change with the
/// ellipsoids. Each rebuild finds them again and numbers them in increasing order of their
/// coordinates, so that the numbers do not depend on the order in which threads found them.

#include <bit>
#include <cstdint>
#include <span>

#include "core/cuda/growing_buffer.h"
#include "fit/cuda/brick_table_view.h"
#include "fit/cuda/supports.h"

namespace esvr::cuda {

/// A box that contains every brick.
inline constexpr Box kAllBricks{{Box::kMin, Box::kMin, Box::kMin},
                                {Box::kMax, Box::kMax, Box::kMax}};

/// Number of slots for a table with this number of entries. The table is at most half full, which
/// keeps probes short.
[[nodiscard]] inline std::size_t slotsFor(std::size_t entries) {
  return std::bit_ceil(2 * entries + 2);
}

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
  void buildTargetTable();
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

}  // namespace esvr::cuda
