#pragma once
/// Draws bricks of cells on the CPU.

#include "render/lazy_cells.h"

namespace esvr {

/// Draws the picture of renderField() with Between::kVoxels.
/// \throws UsageError, Cancelled  as for renderField
[[nodiscard]] Image renderCells(LazyCells& cells, const RenderOptions& options);

}  // namespace esvr
