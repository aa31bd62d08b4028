#pragma once
/// Chooses between ellipsoids and voxels for a goal.

#include <functional>

#include "convert/attempt.h"

namespace esvr::convert {

/// The smaller of two grids that reach a PSNR: voxels or ellipsoids. Voxels are made first, because
/// they take the time of a few passes over the volume. A short fit then shows whether ellipsoids
/// can be smaller; full fits are made only if they can. Voxels of a large volume (isLarge) are
/// either exact or not tried, because each trial would take long.
[[nodiscard]] Conversion convertToPsnr(const Job& job, const PsnrTarget& target);

/// The best grid of a size: exact voxels if they keep to it, otherwise the better of quantised voxels
/// and ellipsoids. A short fit is made before voxels are quantised, because it usually shows that
/// these cannot be better. Voxels of a large volume are treated as for a PSNR.
/// \throws UsageError  neither can be that small
[[nodiscard]] Conversion convertToSize(const Job& job, std::uint64_t bytes);

/// The result of `fit`, or exact voxels if they take no more bytes. `fit` is not called if its
/// number of ellipsoids shows that it cannot be smaller.
[[nodiscard]] Conversion unlessExactIsSmaller(const Job& job,
                                              const std::function<Conversion()>& fit);

}  // namespace esvr::convert
