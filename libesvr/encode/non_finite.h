#pragma once
/// Conversions of volumes that have voxels which are NaN or infinite: these get values that take few bytes, the goal is
/// adapted so that they do not count, and the stored grid says where they were.

#include <functional>

#include "esvr/encode.h"

namespace esvr::encode {

/// Converts a volume without voxels that are not finite.
using FiniteConversion = std::function<Conversion(const ConvertInput&, const ConvertOptions&)>;

/// \param input    has active voxels that are not finite
/// \param convert  is called once, with other values in their places
/// \throws UsageError  a size leaves nothing beside the places of these voxels
/// Other exceptions are those of `convert`.
[[nodiscard]] Conversion convertKeepingNonFinite(const ConvertInput& input,
                                                 const ConvertOptions& options,
                                                 const FiniteConversion& convert);

/// How the values of neighbours become one.
enum class Filling {
  kMeans,  ///< smooth: each is about the mean of its neighbours; for ellipsoids and quantised voxels
  kCopies  ///< no new value, for exact voxels, whose palette would grow
};

/// The volume with a finite value in place of each active one that is not. It comes from the neighbours along the axes,
/// and with them spreads into regions without any. Where no active voxel is connected, it is the background, or the
/// nearest value of the finite ones if the background is beyond them. The range of values remains the same.
/// \param valueType  with kHalf, the values are halfs
[[nodiscard]] SparseVolume withFilledVoxels(const SparseVolume& volume, ValueType valueType,
                                            Filling filling);

}  // namespace esvr::encode
