#pragma once
/// The five synthetic volumes on which the paper compares kinds of ellipsoids (appendix, 'Ellipsoid
/// Type Comparison'). The paper shows slices and gives no formulas; these volumes are similar.

#include "esvr/volume.h"
#include "generators/voxelise.h"

namespace esvr::samples {

/// 8area: a dense volume in eight chunks of different density, each varying smoothly.
[[nodiscard]] SparseVolume makeEightAreas(const SampleOptions& options);

/// EmptySphere: a thin shell.
[[nodiscard]] SparseVolume makeEmptySphere(const SampleOptions& options);

/// SynthTube: straight tubes of different thickness.
[[nodiscard]] SparseVolume makeSynthTube(const SampleOptions& options);

/// SynthWiggle: thin tubes that wind around their axes.
[[nodiscard]] SparseVolume makeSynthWiggle(const SampleOptions& options);

/// DiffuseScalar: a ball that fades out over most of its radius.
[[nodiscard]] SparseVolume makeDiffuseScalar(const SampleOptions& options);

}  // namespace esvr::samples
