#include "convert/choice.h"

#include <cmath>
#include <future>
#include <optional>
#include <string>
#include <utility>

#include "convert/continued_search.h"
#include "convert/exact_voxels.h"
#include "convert/psnr_search.h"
#include "convert/size_search.h"
#include "convert/unless_cancelled.h"
#include "core/add_seconds.h"
#include "esvr/error.h"

namespace esvr::convert {
namespace {

/// The representation of a job. Float32 storage is a form of ellipsoids.
Representation representationOf(const Job& job) {
  if (job.options.storage.form == Storage::kFloat32) return Representation::kEllipsoids;
  return job.options.representation;
}

Candidate record(const VoxelCandidate& voxels) {
  return {voxels.bytes, voxels.psnr, false, voxels.seconds};
}

Candidate record(const Job& job, const Conversion& ellipsoids, double seconds) {
  return {bytesAdded(ellipsoids.grid), psnrOf(job, ellipsoids.grid), false, seconds};
}

Conversion asConversion(VoxelCandidate voxels, const ChoiceRecord& choice, FitEnd end) {
  Conversion conversion;
  conversion.grid = std::move(voxels.grid);
  conversion.fit.end = end;
  conversion.choice = choice;
  conversion.decisions.plateau = voxels.plateau;
  return conversion;
}

/// A conversion to voxels that were chosen instead of ellipsoids with these figures.
Conversion asConversion(VoxelCandidate voxels, const Candidate& ellipsoids, FitEnd end) {
  const ChoiceRecord choice{record(voxels), ellipsoids};
  return asConversion(std::move(voxels), choice, end);
}

/// Records that ellipsoids were taken instead of these voxels.
void recordRejected(const VoxelCandidate& voxels, const ChoiceRecord& choice, Conversion& taken) {
  taken.choice = choice;
  taken.decisions.plateau = voxels.plateau;
  taken.decisions.plateau.used = false;
}

UsageError tooSmall(const Job& job, std::uint64_t bytes, const std::string& needs) {
  return UsageError("grid '" + job.input.descriptor.name + "' " + needs + "; the size allows " +
                    std::to_string(bytes));
}

UsageError tooSmall(const Job& job, std::uint64_t bytes, std::uint64_t needed) {
  return tooSmall(job, bytes, "takes at least " + std::to_string(needed) + " bytes");
}

Conversion ellipsoidsToSize(const Job& job, std::uint64_t bytes) {
  auto result = searchSize(job, bytes);
  if (!result.conversion) throw tooSmall(job, bytes, result.needed);
  return std::move(*result.conversion);
}

/// Voxels that reach a PSNR, and the search for ellipsoids that do.
struct PsnrCandidates {
  VoxelCandidate voxels;
  RestOfSearch search;
  double seconds = 0.0;  ///< wall-clock seconds that `search` took before the voxels were known
};

/// The smaller of voxels and ellipsoids, which must reach the PSNR.
Conversion smallerOf(const Job& job, const PsnrTarget& target, PsnrCandidates candidates) {
  VoxelCandidate& voxels = candidates.voxels;
  double& seconds = candidates.seconds;
  const double psnr = target.psnr;
  const auto below = std::uint64_t(target.worthwhileShare * double(voxels.bytes));
  auto [ellipsoids, expected] = addSeconds(
      seconds, [&] { return unlessCancelled([&] { return candidates.search(below); }); });
  ChoiceRecord choice{record(voxels), {}};
  if (expected > 0) choice.ellipsoids = Candidate{expected, psnr, true, seconds};
  if (ellipsoids) {
    choice.ellipsoids = record(job, *ellipsoids, seconds);
    recordRejected(voxels, choice, *ellipsoids);
    if (choice.ellipsoids->psnr >= psnr && choice.ellipsoids->bytes < voxels.bytes)
      return std::move(*ellipsoids);
  }
  return asConversion(std::move(voxels), choice, FitEnd::kPsnrReached);
}

/// The smaller of exact voxels and ellipsoids that reach the PSNR. If the search was cancelled, its
/// ellipsoids need not reach the PSNR.
Conversion smallerOfExactAnd(const Job& job, double psnr) {
  ExactVoxels exact(job);
  double seconds = 0.0;
  auto [ellipsoids, expected] =
      addSeconds(seconds, [&] { return searchPsnr(job, psnr, exact.figures().bytes); });
  Candidate other{expected, psnr, true, seconds};
  if (ellipsoids) {
    other = record(job, *ellipsoids, seconds);
    const bool ended = other.psnr >= psnr || ellipsoids->fit.end == FitEnd::kCancelled;
    if (ended && !exact.takeAtMost(double(other.bytes))) {
      ellipsoids->choice = ChoiceRecord{exact.figures(), other};
      return std::move(*ellipsoids);
    }
  }
  return asConversion(std::move(exact).take(), other, FitEnd::kPsnrReached);
}

/// The better of `voxels` and ellipsoids of a size.
Conversion betterOf(const Job& job, std::uint64_t bytes, VoxelCandidate voxels) {
  double seconds = 0.0;
  auto result = addSeconds(seconds, [&] {
    return unlessCancelled([&] { return searchSize(job, bytes, voxels.psnr); });
  });
  ChoiceRecord choice{record(voxels), {}};
  if (result.expected > 0.0) choice.ellipsoids = Candidate{bytes, result.expected, true, seconds};
  if (result.conversion) {
    choice.ellipsoids = record(job, *result.conversion, seconds);
    recordRejected(voxels, choice, *result.conversion);
    if (choice.ellipsoids->psnr > voxels.psnr) return std::move(*result.conversion);
  }
  return asConversion(std::move(voxels), choice, FitEnd::kScheduleDone);
}

/// Exact voxels if they keep to a size, otherwise ellipsoids.
Conversion exactOrEllipsoids(const Job& job, std::uint64_t bytes) {
  ExactVoxels exact(job);
  if (!exact.takeAtMost(double(bytes))) return ellipsoidsToSize(job, bytes);
  const ChoiceRecord choice{exact.figures(), {}};
  return asConversion(std::move(exact).take(), choice, FitEnd::kScheduleDone);
}

bool usesGpu(const Job& job) { return job.options.fit.device.kind == DeviceKind::kCuda; }

/// True if a fit for a number of ellipsoids, which is usually small, should not wait for the voxel
/// coder, which has one thread.
bool fitsBesideTheCoder(const Job& job) {
  return job.options.fit.count && usesGpu(job) && !isLarge(job);
}

/// Smallest number of active voxels from which on a GPU makes the short fits of a PSNR search while
/// the CPU codes voxels. The voxels of smaller volumes are soon coded, and often show that no fit
/// is needed.
constexpr std::uint64_t kMinDraftedVoxels = std::uint64_t{1} << 16;

/// Makes the voxels, and on a GPU the short fits beside them. A search that was cancelled before it
/// had a fit finds nothing.
PsnrCandidates psnrCandidates(const Job& job, const PsnrTarget& target) {
  PsnrCandidates made;
  const auto code = [&] { return voxelsForPsnr(job, target); };
  if (!usesGpu(job) || activeVoxelCount(job.input.source) < kMinDraftedVoxels) {
    made.search = [&](auto below) { return searchPsnr(job, target.psnr, below); };
    made.voxels = code();
    return made;
  }
  CancelToken notNeeded(job.options.fit.cancel);
  auto coder = std::async(std::launch::async, [&] {
    VoxelCandidate voxels = code();
    if (voxels.bytes < target.smallEnough) notNeeded.cancel();
    return voxels;
  });
  made.search = addSeconds(made.seconds, [&] {
    return unlessCancelled([&] { return startPsnrSearch(job, target.psnr, notNeeded); });
  });
  made.voxels = coder.get();
  if (!made.search) made.search = [](auto) { return PsnrResult{}; };
  return made;
}

}  // namespace

Conversion convertToPsnr(const Job& job, const PsnrTarget& target) {
  const Representation wanted = representationOf(job);
  if (mayContinue(job))
    if (auto frame = continueTo(job, target.psnr)) return std::move(*frame);
  if (wanted == Representation::kEllipsoids)
    return std::move(*searchPsnr(job, target.psnr).conversion);
  if (wanted == Representation::kAuto && isLarge(job)) return smallerOfExactAnd(job, target.psnr);
  auto found = wanted == Representation::kAuto ? psnrCandidates(job, target)
                                               : PsnrCandidates{voxelsForPsnr(job, target), {}};
  if (found.search && found.voxels.bytes >= target.smallEnough)
    return smallerOf(job, target, std::move(found));
  const ChoiceRecord choice{record(found.voxels), {}};
  return asConversion(std::move(found.voxels), choice, FitEnd::kPsnrReached);
}

Conversion convertToSize(const Job& job, std::uint64_t bytes) {
  const Representation wanted = representationOf(job);
  if (wanted == Representation::kEllipsoids) return ellipsoidsToSize(job, bytes);
  if (wanted == Representation::kAuto && isLarge(job)) return exactOrEllipsoids(job, bytes);
  auto voxels = voxelsForSize(job, bytes);
  if (!voxels && wanted == Representation::kVoxels)
    throw tooSmall(job, bytes, "has no voxels of that size");
  if (!voxels) return ellipsoidsToSize(job, bytes);
  if (wanted == Representation::kVoxels || std::isinf(voxels->psnr)) {
    const ChoiceRecord choice{record(*voxels), {}};
    return asConversion(std::move(*voxels), choice, FitEnd::kScheduleDone);
  }
  return betterOf(job, bytes, std::move(*voxels));
}

Conversion unlessExactIsSmaller(const Job& job, const std::function<Conversion()>& fit) {
  if (representationOf(job) != Representation::kAuto) return fit();
  const double count = double(plannedCount(job.options.fit, activeVoxelCount(job.input.source)));
  ExactVoxels exact(job);
  std::optional<Conversion> fitted;
  double seconds = 0.0;
  if (fitsBesideTheCoder(job)) {
    auto coder = std::async(std::launch::async, [&] { return exactVoxels(job); });
    fitted = addSeconds(seconds, fit);
    exact.set(coder.get());
  }
  Candidate ellipsoids{std::uint64_t(kBytesPerEllipsoid * count), {}, true};
  if (fitted || !exact.takeAtMost(kMinBytesPerEllipsoid * count)) {
    if (!fitted) fitted = addSeconds(seconds, fit);
    // Their PSNR would take a decoding.
    ellipsoids = {bytesAdded(fitted->grid), {}, false, seconds};
    if (!exact.takeAtMost(double(ellipsoids.bytes))) {
      fitted->choice = ChoiceRecord{exact.figures(), ellipsoids};
      return std::move(*fitted);
    }
  }
  return asConversion(std::move(exact).take(), ellipsoids, FitEnd::kScheduleDone);
}

}  // namespace esvr::convert
