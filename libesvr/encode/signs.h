#pragma once
/// The surfaces of level sets: conversions of narrow bands, which keep the sign of every voxel, and what a
/// value of any other level set means as a distance.

#include <functional>
#include <optional>

#include "encode/job.h"

namespace esvr::encode {

/// Converts a job as if it were no narrow band.
using ConvertTo = std::function<Conversion(const Job&)>;

/// Converts a narrow band. Ellipsoids get a residual (withSigns) where a sign is wrong; for a SizeGoal, EllipsoidSearch
/// leaves room for it. With Representation::kAuto, voxels are stored if the residual makes ellipsoids larger than them.
/// Exceptions are those of `convertTo`.
[[nodiscard]] Conversion convertNarrowBand(const Job& job, const ConvertTo& convertTo);

/// The usual difference of two neighbours of which one is inside the surface and one is not: about the change of
/// the values by one voxel across it. It is the median over all such pairs of active voxels, so that
/// markers of empty space do not count.
/// \return nothing if there is no such pair, and no surface
[[nodiscard]] std::optional<double> changeAcrossSurface(const SparseVolume& volume);

/// Corrects the sign of every voxel of a narrow band where the sum has another one than the source,
/// by a residual. A reader on any machine then finds the signs of the source: evaluations on different
/// machines differ by rounding (field.h), and the residual includes a margin for that.
/// \param grid  a narrow band without a residual that makeStoredGrid made from `source`
/// \return the grid without a residual if no sign is wrong
[[nodiscard]] StoredGrid withSigns(StoredGrid grid, const SparseVolume& source);
/// The same for a grid that is not given up if the conversion is cancelled.
[[nodiscard]] StoredGrid completedWithSigns(StoredGrid grid, const SparseVolume& source);

/// Checks that a decoded narrow band has the signs of its source, in its bricks and elsewhere.
/// \throws RuntimeFailure  a sign differs; the text names the grid and the voxel
void requireSigns(const ConvertInput& input, const SparseVolume& decoded);

}  // namespace esvr::encode
