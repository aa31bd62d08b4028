#pragma once
/// The section of the voxels that are NaN or infinite (StoredGrid::nonFiniteVoxels): how they are collected from a
/// volume, stored, checked, and given back to a decoded volume.

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "esvr/container.h"
#include "esvr/volume.h"
#include "format/records.h"
#include "format/section_reader.h"

namespace esvr::format {

/// The layer of the active voxels of a volume that are not finite; nothing if there is none.
[[nodiscard]] std::optional<VoxelLayer> nonFiniteLayer(const SparseVolume& volume);

/// The numbers of its voxels. Its codes must have values.
[[nodiscard]] NonFiniteCounts countsOf(const VoxelLayer& layer);

/// The layer must be one that nonFiniteLayer() could have made within the active box, with as many voxels as the grid
/// says.
[[nodiscard]] std::optional<Fault> nonFiniteFaultOf(const StoredGrid& grid);

/// The content of the section.
/// \param before  the same grid of the frame before; null: the grid stands alone. If it has the same voxels, the
///                content is empty
[[nodiscard]] std::vector<std::byte> putNonFinite(const StoredGrid& grid, const StoredGrid* before);

/// Reads the section of grid `g`, if its record says that there is one.
/// \param previous  the frame before; null: the file stands alone
/// \throws BadInput  the section is missing or damaged, or it refers to a frame before that has other voxels
/// \throws MemoryExceeded  it needs more than the budget
void getNonFinite(SectionReader& sections, std::uint32_t g, const EsvrFile* previous,
                  StoredGrid& grid);

/// What a decoded volume gets where a grid has voxels that are not finite.
enum class NonFiniteAs {
  kStored,  ///< the voxels are active and have their values
  kEmpty    ///< they are inactive and have the background
};
/// Where they are given back.
struct NonFinitePlace {
  Box box;                                            ///< voxels outside are left as they are
  std::optional<std::span<const Coord>> bricks = {};  ///< increasing corners; nothing: all bricks
};
void restoreNonFinite(const StoredGrid& grid, const NonFinitePlace& place, NonFiniteAs as,
                      SparseVolume& volume);

}  // namespace esvr::format
