#include "convert/narrow_band.h"

#include <string>
#include <utility>
#include <variant>

#include "convert/exact_voxels.h"
#include "esvr/empty_signs.h"
#include "esvr/error.h"
#include "esvr/residual.h"
#include "esvr/sign_errors.h"

namespace esvr::convert {
namespace {

/// Fits for a size: each one leaves more room for the residual of the signs.
constexpr int kMaxFitsForSize = 4;
/// Factor of the room for the residual of the fit before. A smaller grid has more wrong signs.
constexpr double kRoomFactor = 1.2;

Conversion corrected(const Job& job, Conversion conversion) {
  if (!conversion.grid.voxels && !conversion.grid.residual)
    conversion.grid = withSigns(std::move(conversion.grid), job.input.source);
  return conversion;
}

bool storesVoxels(const Job& job) {
  return job.options.representation == Representation::kAuto &&
         job.options.storage.form == Storage::kCompact &&
         !std::holds_alternative<FitGoal>(job.options.goal) && !isLarge(job);
}

using ConvertTo = std::function<Conversion(const Job&)>;

/// Repeats a conversion to a size with fewer bytes until its residual fits in, too.
Conversion withRoomForSigns(const Job& job, std::uint64_t bytes, const ConvertTo& convertTo) {
  ConvertOptions options = job.options;
  std::uint64_t left = bytes;
  for (int fits = 0; fits < kMaxFitsForSize; ++fits) {
    options.goal = SizeGoal{left};
    Conversion made = corrected(job, convertTo({job.input, options, job.limits}));
    const std::uint64_t taken = bytesAdded(made.grid);
    if (taken <= bytes) return made;
    const auto room = std::uint64_t(kRoomFactor * double(taken - left));
    if (room >= bytes) break;
    left = bytes - room;
  }
  throw UsageError("grid '" + job.input.descriptor.name +
                   "': ellipsoids with the signs of the "
                   "level set do not fit into " +
                   std::to_string(bytes) + " bytes");
}

}  // namespace

Conversion convertNarrowBand(const Job& job, const ConvertTo& convertTo) {
  ConvertOptions options = job.options;
  if (storesVoxels(job)) options.representation = Representation::kVoxels;
  const Job own{job.input, options, job.limits};
  if (const auto* size = std::get_if<SizeGoal>(&options.goal))
    return withRoomForSigns(own, size->bytes, convertTo);
  return corrected(own, convertTo(own));
}

void requireSigns(const ConvertInput& input, const SparseVolume& decoded) {
  const SignErrors errors = compareSigns(input.source, decoded);
  const std::string grid = "grid '" + input.descriptor.name + "': ";
  if (errors.first)
    throw RuntimeFailure(grid + std::to_string(errors.voxels) +
                         " voxels are on the wrong side of the surface, for example voxel " +
                         toString(*errors.first));
  if (!EmptySigns(decoded).agree())
    throw RuntimeFailure(grid + "the surface of the decoded voxels has holes");
}

}  // namespace esvr::convert
