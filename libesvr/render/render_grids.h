#pragma once
/// Draws several grids in one picture on the CPU.

#include <memory>
#include <vector>

#include "esvr/renderer.h"
#include "render/brick_atlas.h"
#include "render/lazy_cells.h"

namespace esvr {

/// The bricks of a field or of a volume for marchGrids().
struct GridSlots {
  const LazyCells* field;  ///< null: those of a volume
  BrickSlotsView volume;

  [[nodiscard]] std::uint32_t slot(std::uint32_t brick) const {
    return field == nullptr ? volume.slot(brick) : LazySlots{*field}.slot(brick);
  }
  [[nodiscard]] static bool hasSlot(std::uint32_t slot) { return BrickSlotsView::hasSlot(slot); }
  [[nodiscard]] const float* values(std::uint32_t slot) const {
    return field == nullptr ? volume.values(slot) : field->values(slot);
  }
};

/// The cells of a grid. Those of a field are decoded when a ray reads them.
class GridCells {
 public:
  /// \throws  as for LazyCells and makeBrickAtlas
  explicit GridCells(const DrawnGrid& grid);

  [[nodiscard]] float background() const { return background_; }
  [[nodiscard]] const BrickTable& table() const { return field_ ? field_->table(0) : atlas_.table; }
  [[nodiscard]] GridSlots slots() const { return {field_.get(), {nullptr, pages_.data()}}; }
  void forget() {
    if (field_) field_->forget();
  }

 private:
  std::unique_ptr<LazyCells> field_;  ///< null: the grid is a volume
  BrickAtlas atlas_;
  std::vector<const float*> pages_;
  float background_;
};

/// Draws a picture of makeGridsRenderer().
/// \throws UsageError  as for Renderer::draw() of several grids
/// \throws Cancelled   RenderOptions::cancel was set
[[nodiscard]] Image renderGrids(const std::vector<GridCells>& grids, const RenderOptions& options);

}  // namespace esvr
