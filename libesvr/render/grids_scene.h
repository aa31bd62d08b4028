#pragma once
/// Sets up the scene of a picture of several grids.

#include <vector>

#include "render/brick_cover.h"
#include "render/grids_march.h"

namespace esvr {

/// \throws UsageError  as for renderField; the options have not as many looks as there are grids, or
///                     ask for something that several grids do not have (makeGridsRenderer)
void checkGridsOptions(const RenderOptions& options, std::size_t grids);

/// The look of a grid of a picture; that of the first one is RenderOptions::transfer.
[[nodiscard]] GridLook lookOf(const RenderOptions& options, std::size_t grid);

/// The cells of a grid.
struct GridTable {
  BrickTableView table;
  PlaceBox box;  ///< of the cells, relative to the table's origin; empty if there are none
  TransferTableView transfer;
  float background;
};

/// A box around the cells of all grids, in index space; empty if no grid has cells.
[[nodiscard]] PlaceBox boxAround(const std::vector<GridTable>& grids);

/// \param options  as checkGridsOptions() requires
/// \param grids    at least one of them has cells
[[nodiscard]] GridsScene gridsScene(const RenderOptions& options,
                                    const std::vector<GridTable>& grids);

/// The first sample of a bin in which a ray may meet a grid, counted from the eye.
/// \throws UsageError  a ray is too long
[[nodiscard]] double firstSampleOf(const GridsScene& scene);

/// The view for covers of the bricks of a grid, whose places are relative to its table's origin.
[[nodiscard]] CoverView coverViewOf(const GridsScene& scene, std::size_t grid,
                                    Resolution resolution);

}  // namespace esvr
