#pragma once
/// Bricks of cells on a CUDA device that are decoded from a field when a ray asks for them, and
/// dropped when memory is short.

#include <optional>
#include <vector>

#include "core/cuda/growing_buffer.h"
#include "core/cuda/pinned.h"
#include "render/cell_field.h"
#include "render/cuda/brick_draw.h"
#include "render/cuda/decode_cells.h"
#include "render/slot_list.h"

namespace esvr::cuda {

/// A CellField in device memory.
class DeviceCells {
 public:
  DeviceCells(const CellField& field, cudaStream_t stream);

  [[nodiscard]] CellFieldView view() const;
  [[nodiscard]] BrickTableView table() const {
    return {{0, 0, 0}, blocks_, blockOf_.data(), brickOf_.data()};
  }
  [[nodiscard]] const Coord* bricks() const { return bricks_.data(); }
  [[nodiscard]] std::uint32_t count() const { return std::uint32_t(bricks_.size()); }
  [[nodiscard]] std::size_t bytes() const;

 private:
  Coord origin_, blocks_;
  VoxelRule rule_;
  DeviceBuffer<std::uint32_t> blockOf_, brickOf_;
  DeviceBuffer<Coord> bricks_;
  DeviceBuffer<CellForm> forms_;
  DeviceBuffer<KernelConstants<float>> kernels_;
  DeviceBuffer<Coord> origins_;
  DeviceBuffer<std::uint32_t> begin_, ellipsoid_;
  DeviceBuffer<std::uint8_t> corners_;
};

class BrickCache {
 public:
  static constexpr std::size_t kPageBytes = BrickSlotsView::kPageFloats * sizeof(float);

  /// \param cells  must outlive the cache
  BrickCache(const DeviceCells& cells, cudaStream_t stream);

  /// Limits the memory of the voxels from now on; at least one page is kept.
  void limit(std::uint64_t bytes) { maxBytes_ = bytes; }

  [[nodiscard]] BrickSlotsView slots() const { return {slotOf_.data(), pageTable_.data()}; }
  /// What rays write to ask for bricks. A call begins a new time, so that bricks which are read
  /// later are dropped later.
  [[nodiscard]] BrickDemand demand();
  [[nodiscard]] BrickDemand::Counts counts();
  /// Forgets all bricks. The memory stays.
  void forget();
  /// Decodes the bricks that rays have asked for, as many as there is room for; the others become
  /// missing again. Clears the demand.
  /// \throws DeviceMemoryError  there is no memory for a single page
  void serve(std::uint32_t asked);

  [[nodiscard]] std::size_t bytes() const;

 private:
  void makeRoomFor(std::size_t bricks);
  [[nodiscard]] bool addPage();
  void evict(std::size_t bricks);
  void set(std::vector<SlotOfBrick> changes);
  void decode(const std::vector<SlotOfBrick>& wanted);

  const DeviceCells& cells_;
  cudaStream_t stream_;
  std::uint64_t maxBytes_ = 0;  ///< 0: no limit
  bool crowded_ = false;        ///< whether the last rays asked for more bricks than had room
  std::uint32_t now_ = 0;
  SlotList list_;
  std::vector<DeviceBuffer<float>> pages_;
  GrowingBuffer<float*> pageTable_;
  DeviceBuffer<std::uint32_t> slotOf_, asked_;
  DeviceBuffer<BrickDemand::Counts> counts_;
  Pinned<BrickDemand::Counts> downloaded_;
  GrowingBuffer<std::uint32_t> stamps_;
  GrowingBuffer<SlotOfBrick> changes_;
  GrowingBuffer<std::uint8_t> occupied_;
};

}  // namespace esvr::cuda
