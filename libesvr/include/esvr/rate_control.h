#pragma once
/// Fits to what a file may take or must reach: number of ellipsoids and bits are traded for each
/// other by what was measured of either.

#include <cstdint>

#include "esvr/compact.h"
#include "esvr/fit.h"
#include "esvr/grid_descriptor.h"
#include "esvr/sparse_volume.h"
#include "esvr/voxel_layer.h"

namespace esvr {

/// A grid on its way into a file.
struct RatedGrid {
  FitResult fit;  ///< without its field and its curve, which the grid has
  StoredGrid grid;
  CompactResult compact;  ///< without its grid
};

/// What is fitted, and how; `options.count`, `psnr` and `seconds` are chosen here.
struct RateInput {
  const GridDescriptor& descriptor;
  const SparseVolume& source;
  FitOptions options;
  Activity activity = Activity::kByValue;  ///< what is stored of which voxels are active
};

/// The best of so many bytes: a short fit tells what an ellipsoid costs, a second one has as many
/// as fit. The file has no curve. \param bytes  that the grid may add to a file, its section
/// table's rows included \throws UsageError  not even an empty sum is that small; else as fit
[[nodiscard]] RatedGrid fitToSize(const RateInput& input, std::uint64_t bytes);

/// The smallest found that reaches a PSNR over the box: after a short fit, full ones whose numbers
/// of ellipsoids follow from what the ones before reached. Where it is out of reach the best,
/// marked kPsnrMissed. The file has no curve. \throws as fit
[[nodiscard]] RatedGrid fitToPsnr(const RateInput& input, double psnr);

}  // namespace esvr
