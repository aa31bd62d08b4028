#pragma once
/// Bricks of cells on a CUDA device that are decoded from a field when a ray asks for them, and
/// dropped when memory is short.

#include <vector>

#include "core/cuda/growing_buffer.h"
#include "core/cuda/pinned.h"
#include "render/cell_field.h"
#include "render/cuda/brick_demand.h"
#include "render/cuda/decode_cells.h"
#include "render/cuda/device_level.h"
#include "render/cuda/slot_account.h"

namespace esvr::cuda {

/// A CellField in device memory, and the bricks of its levels of detail.
class DeviceCells {
 public:
  DeviceCells(const CellField& field, cudaStream_t stream);

  /// Adds the next coarser level, whose first brick has the number brickCount().
  void add(DeviceLevel level) { levels_.push_back(std::move(level)); }

  [[nodiscard]] CellFieldView view() const;
  [[nodiscard]] const DeviceLevel& level(int level) const { return levels_[std::size_t(level)]; }
  [[nodiscard]] int levelCount() const { return int(levels_.size()); }
  /// The number of bricks of all levels.
  [[nodiscard]] std::uint32_t brickCount() const {
    return levels_.back().first() + levels_.back().count();
  }
  [[nodiscard]] float background() const { return rule_.background; }
  [[nodiscard]] std::size_t bytes() const;

 private:
  VoxelRule rule_;
  Box box_;
  std::vector<DeviceLevel> levels_;
  DeviceBuffer<CellForm> forms_;
  DeviceBuffer<KernelConstants<float>> kernels_;
  DeviceBuffer<Coord> origins_;
  DeviceBuffer<std::uint32_t> begin_, ellipsoid_;
  DeviceBuffer<std::uint8_t> corners_;
  DeviceBuffer<BrickMask> masks_;
  DeviceBuffer<BlockLevels> blockLevels_;
  DeviceBuffer<std::uint32_t> ruleOf_;
};

class BrickCache {
 public:
  /// Bytes of a page and of its slots in the tables, of which GrowingBuffer keeps a quarter to spare.
  static constexpr std::size_t kPageBytes =
      BrickSlotsView::kPageFloats * sizeof(float) +
      BrickSlotsView::kPageSlots * (4 * sizeof(std::uint32_t) + sizeof(std::uint8_t)) * 5 / 4;

  /// \param cells  must outlive the cache
  BrickCache(const DeviceCells& cells, cudaStream_t stream);

  /// Takes account of all bricks of the cells, after levels were added. All are forgotten.
  void number();
  /// Limits the memory of the voxels from now on; at least one page is kept.
  void limit(std::uint64_t bytes) { maxBytes_ = bytes; }

  [[nodiscard]] BrickSlotsView slots() const { return {slotOf_.data(), pageTable_.data()}; }
  /// What rays write to ask for bricks. A call begins a new time, so that bricks which are read
  /// later are dropped later.
  /// \param pass  how often the rays of the picture have waited
  [[nodiscard]] BrickDemand demand(int pass);
  [[nodiscard]] BrickDemand::Counts counts();
  /// Whether there was no room for all bricks that rays asked for last. In the next pass, a ray then
  /// asks for no brick but the one at which it waits.
  [[nodiscard]] bool isCrowded() const { return crowded_; }
  /// The number of bricks for which there is room now.
  [[nodiscard]] std::uint32_t slotCount() const {
    return std::uint32_t(pages_.size()) * BrickSlotsView::kPageSlots;
  }
  /// Forgets all bricks. The memory stays.
  void forget();
  /// Decodes the bricks that rays have asked for, as many as there is room for; the others become
  /// missing again.
  /// \param levels  those of the bricks
  /// \throws DeviceMemoryError  there is no memory for a single page
  void serve(const BrickDemand::Counts& counts, const LevelBounds& levels);

  [[nodiscard]] std::size_t bytes() const;
  /// The smallest number of bytes with which it works.
  [[nodiscard]] std::size_t fixedBytes() const {
    return slotOf_.bytes() + asked_.bytes() + kPageBytes;
  }

 private:
  [[nodiscard]] SlotAccount account();
  [[nodiscard]] std::uint32_t makeRoomFor(std::uint32_t bricks, std::uint32_t free);
  [[nodiscard]] bool mayAddPage() const;
  [[nodiscard]] bool addPage(std::uint32_t free);
  void extendTables(float* page);
  [[nodiscard]] std::uint32_t evict(std::uint32_t bricks, std::uint32_t free);
  void decode(std::uint32_t bricks, std::uint32_t free, const LevelBounds& levels);

  const DeviceCells& cells_;
  cudaStream_t stream_;
  std::uint64_t maxBytes_ = 0;  ///< 0: no limit
  bool crowded_ = false;
  std::uint32_t now_ = 0;
  std::vector<DeviceBuffer<float>> pages_;
  GrowingBuffer<float*> pageTable_;
  DeviceBuffer<std::uint32_t> slotOf_, asked_;
  GrowingBuffer<std::uint32_t> owners_, stamps_, free_, spare_;
  GrowingBuffer<std::uint8_t> occupied_;
  DeviceBuffer<BrickDemand::Counts> counts_;
  Pinned<BrickDemand::Counts> downloaded_;
};

}  // namespace esvr::cuda
