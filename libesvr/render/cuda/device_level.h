#pragma once
/// The bricks of cells of a level of detail in device memory.

#include "core/cuda/device_buffer.h"
#include "render/brick_table.h"

namespace esvr::cuda {

class DeviceLevel {
 public:
  DeviceLevel(const BrickTable& table, cudaStream_t stream)
      : origin_(table.origin),
        blocks_(table.blocks),
        box_(cellsOf(table)),
        first_(table.first),
        blockOf_(table.blockOf, stream),
        rows_(table.rows, stream),
        bricks_(table.bricks, stream) {}

  [[nodiscard]] BrickTableView table() const {
    return {origin_, blocks_, blockOf_.data(), rows_.data()};
  }
  [[nodiscard]] const PlaceBox& box() const { return box_; }
  [[nodiscard]] std::uint32_t first() const { return first_; }  ///< number of the first brick
  [[nodiscard]] std::uint32_t count() const { return std::uint32_t(bricks_.size()); }
  /// By brick from the first one: its place relative to the table's origin, in bricks.
  [[nodiscard]] const Coord* bricks() const { return bricks_.data(); }
  [[nodiscard]] std::size_t bytes() const {
    return blockOf_.bytes() + rows_.bytes() + bricks_.bytes();
  }

 private:
  Coord origin_, blocks_;
  PlaceBox box_;
  std::uint32_t first_;
  DeviceBuffer<std::uint32_t> blockOf_;
  DeviceBuffer<BrickRow> rows_;
  DeviceBuffer<Coord> bricks_;
};

}  // namespace esvr::cuda
