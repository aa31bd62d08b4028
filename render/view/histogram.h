#pragma once
/// Histograms of the active values of a grid.

#include <cstdint>
#include <string>
#include <vector>

#include "esvr/sparse_volume.h"
#include "render/view/scene_json.h"

namespace esvr::view {

inline constexpr std::size_t kHistogramBins = 256;

/// The number of active voxels in each of kHistogramBins parts of a range of the same width. Values
/// outside the range count in the first or last part. If the range has no extent, all count in the
/// first one.
[[nodiscard]] std::vector<std::uint64_t> histogramOf(const SparseVolume& volume, ValueRange range);

/// The answer to "histogram".
[[nodiscard]] std::string histogramMessage(const GridPlace& place, ValueRange range,
                                           const std::vector<std::uint64_t>& counts);

}  // namespace esvr::view
