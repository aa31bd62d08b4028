#include "convert/narrow_band.h"

#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "convert/exact_voxels.h"
#include "convert/unless_cancelled.h"
#include "esvr/compact.h"
#include "esvr/error.h"
#include "esvr/grid.h"
#include "esvr/metrics.h"
#include "esvr/volume.h"

namespace esvr::convert {
namespace {

/// Conversions to a size: each one after the first leaves more room for the residual of the signs.
constexpr int kMaxFitsForSize = 4;
/// Factor of the room for the residual of the fit before. A smaller grid has more wrong signs.
constexpr double kRoomFactor = 1.2;

Conversion corrected(const Job& job, Conversion conversion) {
  if (conversion.grid.voxels || conversion.grid.residual) return conversion;
  auto grid =
      unlessCancelled([&] { return std::optional(withSigns(conversion.grid, job.input.source)); });
  if (!grid) {  // without these signs, the ellipsoids of a band are of no use
    const BestSoFar completion;
    grid = withSigns(std::move(conversion.grid), job.input.source);
  }
  conversion.grid = std::move(*grid);
  return conversion;
}

using ConvertTo = std::function<Conversion(const Job&)>;

/// Ellipsoids with a residual that keep to a size: the conversion is repeated with fewer bytes until
/// the residual fits in. \param made  a first conversion to the size
std::optional<Conversion> withRoomForSigns(const Job& job, std::uint64_t bytes, Conversion made,
                                           const ConvertTo& convertTo) {
  ConvertOptions options = job.options;
  options.representation = Representation::kEllipsoids;
  std::uint64_t left = bytes;
  for (int fits = 1; fits < kMaxFitsForSize; ++fits) {
    const auto room = std::uint64_t(kRoomFactor * double(bytesAdded(made.grid) - left));
    if (2 * room >= bytes) return std::nullopt;
    left = bytes - room;
    options.goal = SizeGoal{left};
    made = corrected(job, convertTo({job.input, options, job.limits}));
    if (bytesAdded(made.grid) <= bytes) return made;
  }
  return std::nullopt;
}

Conversion bandAsVoxels(const Job& job, const ConvertTo& convertTo) {
  ConvertOptions options = job.options;
  options.representation = Representation::kVoxels;
  return convertTo({job.input, options, job.limits});
}

bool mayStoreVoxels(const Job& job) {
  return job.options.representation == Representation::kAuto &&
         job.options.storage.form == Storage::kCompact &&
         !std::holds_alternative<FitGoal>(job.options.goal) && !isLarge(job);
}

/// Voxels of a size, if there are any.
std::optional<Conversion> bandAsVoxelsOfSize(const Job& job, const ConvertTo& convertTo) try {
  return bandAsVoxels(job, convertTo);
} catch (const UsageError&) {
  return std::nullopt;
}

Conversion bandToSize(const Job& job, std::uint64_t bytes, const ConvertTo& convertTo) {
  Conversion made = corrected(job, convertTo(job));
  if (bytesOfEllipsoids(made.grid) <= bytes) return made;
  if (auto fitted = withRoomForSigns(job, bytes, std::move(made), convertTo))
    return std::move(*fitted);
  const bool mayBeVoxels = mayStoreVoxels(job);
  if (mayBeVoxels)
    if (auto voxels = bandAsVoxelsOfSize(job, convertTo)) return std::move(*voxels);
  throw UsageError("grid '" + shownName(job.input.descriptor.name) +
                   "': ellipsoids and the residual that corrects the signs of the level set do not "
                   "fit into " +
                   std::to_string(bytes) + " bytes" + (mayBeVoxels ? ", and voxels neither" : ""));
}

/// True if the voxels that were compared with the ellipsoids take fewer bytes than these and their
/// residual together.
bool voxelsAreSmaller(const Job& job, const Conversion& made) {
  return made.grid.residual && mayStoreVoxels(job) && made.choice && made.choice->voxels &&
         made.choice->voxels->bytes <= bytesAdded(made.grid);
}

}  // namespace

Conversion convertNarrowBand(const Job& job, const ConvertTo& convertTo) {
  if (const auto* size = std::get_if<SizeGoal>(&job.options.goal))
    return bandToSize(job, size->bytes, convertTo);
  Conversion made = corrected(job, convertTo(job));
  auto smaller = unlessCancelled([&]() -> std::optional<Conversion> {
    if (isCancelled(job) || !voxelsAreSmaller(job, made)) return std::nullopt;
    return bandAsVoxels(job, convertTo);
  });
  return smaller ? std::move(*smaller) : std::move(made);
}

void requireSigns(const ConvertInput& input, const SparseVolume& decoded) {
  const SignErrors errors = compareSigns(input.source, decoded);
  const std::string grid = "grid '" + shownName(input.descriptor.name) + "': ";
  if (errors.first)
    throw RuntimeFailure(grid + std::to_string(errors.voxels) +
                         " voxels are on the wrong side of the surface, for example voxel " +
                         toString(*errors.first));
  if (!EmptySigns(decoded).agree())
    throw RuntimeFailure(grid + "the surface of the decoded voxels has holes");
}

}  // namespace esvr::convert
