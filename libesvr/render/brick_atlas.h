#pragma once
/// A volume as bricks of cells, the form in which rays march through it (brick_march.h). A cell is
/// the cube between eight neighbouring voxels.

#include <vector>

#include "esvr/sparse_volume.h"
#include "render/brick_table.h"

namespace esvr {

/// Holds every brick of cells that has a voxel other than the background.
struct BrickAtlas {
  BrickTable table;
  std::vector<float> values;  ///< kCellBrickVoxels for each brick, in the order of the table

  /// Pointers to the pages of the values.
  [[nodiscard]] std::vector<const float*> pages() const;
};

/// \param first   number of the first brick
/// \throws UsageError  as for makeBrickTable
[[nodiscard]] BrickAtlas makeBrickAtlas(const SparseVolume& volume, std::uint32_t first = 0);

}  // namespace esvr
