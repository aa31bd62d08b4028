#include "convert/choice.h"

#include <cmath>
#include <future>
#include <optional>
#include <string>
#include <utility>

#include "convert/psnr_search.h"
#include "convert/size_search.h"
#include "convert/unless_cancelled.h"
#include "convert/voxel_search.h"
#include "core/add_seconds.h"
#include "esvr/error.h"

namespace esvr::convert {
namespace {

/// Largest number of voxels in bricks for which voxels are tried as an alternative.
constexpr std::size_t kMaxVoxels = std::size_t{1} << 25;

/// The representation of a job. Float32 storage is a form of ellipsoids.
Representation representationOf(const Job& job) {
  if (job.options.storage.form == Storage::kFloat32) return Representation::kEllipsoids;
  const Representation wanted = job.options.representation;
  if (wanted == Representation::kAuto && isTooLargeForVoxels(job))
    return Representation::kEllipsoids;
  return wanted;
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

/// The smaller of `voxels` and ellipsoids, which must reach the PSNR.
Conversion smallerOf(const Job& job, const PsnrTarget& target, VoxelCandidate voxels) {
  const double psnr = target.psnr;
  const auto below = std::uint64_t(target.worthwhileShare * double(voxels.bytes));
  double seconds = 0.0;
  auto [ellipsoids, expected] = addSeconds(
      seconds, [&] { return unlessCancelled([&] { return searchPsnr(job, psnr, below); }); });
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

}  // namespace

bool isTooLargeForVoxels(const Job& job) { return job.input.source.values.size() > kMaxVoxels; }

Conversion convertToPsnr(const Job& job, const PsnrTarget& target) {
  const Representation wanted = representationOf(job);
  if (wanted == Representation::kEllipsoids)
    return std::move(*searchPsnr(job, target.psnr).conversion);
  auto voxels = voxelsForPsnr(job, target);
  if (wanted == Representation::kAuto && voxels.bytes >= target.smallEnough)
    return smallerOf(job, target, std::move(voxels));
  const ChoiceRecord choice{record(voxels), {}};
  return asConversion(std::move(voxels), choice, FitEnd::kPsnrReached);
}

Conversion convertToSize(const Job& job, std::uint64_t bytes) {
  const Representation wanted = representationOf(job);
  if (wanted == Representation::kEllipsoids) return ellipsoidsToSize(job, bytes);
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
  const FitOptions& options = job.options.fit;
  const double count = double(plannedCount(options, activeVoxelCount(job.input.source)));
  // The voxel coder has one thread. A GPU does not wait for it where a number of ellipsoids is
  // wanted, which is usually small.
  const bool atOnce = options.count && options.device.kind == DeviceKind::kCuda;
  std::future<VoxelCandidate> coder = std::async(
      atOnce ? std::launch::async : std::launch::deferred, [&] { return exactVoxels(job); });
  std::optional<Conversion> fitted;
  double seconds = 0.0;
  if (atOnce) fitted = addSeconds(seconds, fit);
  VoxelCandidate exact = coder.get();
  ChoiceRecord choice{record(exact),
                      Candidate{std::uint64_t(kBytesPerEllipsoid * count), {}, true}};
  if (!fitted && double(exact.bytes) <= kMinBytesPerEllipsoid * count)
    return asConversion(std::move(exact), choice, FitEnd::kScheduleDone);
  if (!fitted) fitted = addSeconds(seconds, fit);
  choice.ellipsoids = Candidate{bytesAdded(fitted->grid)};  // its PSNR would take a decoding
  choice.ellipsoids->seconds = seconds;
  fitted->choice = choice;
  if (choice.ellipsoids->bytes < exact.bytes) return std::move(*fitted);
  return asConversion(std::move(exact), choice, FitEnd::kScheduleDone);
}

}  // namespace esvr::convert
