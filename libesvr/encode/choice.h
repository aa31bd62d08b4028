#pragma once
/// The choice between voxels and ellipsoids.

#include <cstdint>

#include "encode/job.h"

namespace esvr::encode {

/// When ellipsoids are worth their fits.
struct Worthwhile {
  /// The share of the voxels' bytes that ellipsoids must be expected to stay below.
  double share = 1.0;
  /// Bytes of voxels below which no ellipsoids are tried, unless they are far smaller.
  std::uint64_t smallEnough = 0;
};

/// The smaller one of voxels and ellipsoids with a quality, dB as the job measures it.
[[nodiscard]] Conversion convertToQuality(const Job& job, double quality,
                                          const Worthwhile& worthwhile);

/// The better one of voxels and ellipsoids of a size.
/// \throws UsageError  neither fits into it
[[nodiscard]] Conversion convertToSize(const Job& job, std::uint64_t bytes);

/// The result of a single fit, or exact voxels if they take no more bytes. No fit is made if its number
/// of ellipsoids shows that it cannot be smaller.
[[nodiscard]] Conversion fitOrExact(const Job& job);

/// True if all active voxels have one value: exact voxels take hardly more than their mask.
[[nodiscard]] bool isConstant(const SparseVolume& volume);

}  // namespace esvr::encode
