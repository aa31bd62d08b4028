#include "convert/choice.h"

#include <future>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "convert/exact_voxels.h"
#include "convert/psnr_search.h"
#include "convert/size_search.h"
#include "convert/unless_cancelled.h"
#include "core/add_seconds.h"
#include "esvr/error.h"
#include "esvr/grid.h"

namespace esvr::convert {
namespace {

/// The representation of a job. Float32 storage is a form of ellipsoids.
Representation representationOf(const Job& job) {
  if (job.options.storage.form == Storage::kFloat32) return Representation::kEllipsoids;
  return job.options.representation;
}

/// Returns the result of `work`, which makes fits. It is empty if they were cancelled before they had
/// an ellipsoid.
/// \param seconds  the time that it takes is added to this
template <class Work>
auto fitted(double& seconds, const Work& work) {
  return addSeconds(seconds, [&] { return unlessCancelled(work); });
}

Candidate record(const VoxelCandidate& voxels) {
  return {voxels.bytes, voxels.psnr, false, voxels.seconds};
}

Candidate record(const Job& job, const Conversion& ellipsoids, double seconds) {
  return {bytesOfEllipsoids(ellipsoids.grid), psnrOf(job, ellipsoids), false, seconds};
}

Conversion asConversion(VoxelCandidate voxels, const ChoiceRecord& choice, FitEnd end) {
  Conversion conversion;
  conversion.grid = std::move(voxels.grid);
  conversion.fit.end = end;
  conversion.choice = choice;
  conversion.decisions.plateau = voxels.plateau;
  return conversion;
}

/// A conversion to the voxels that a cancelled search has found.
Conversion asConversion(VoxelCandidate voxels) {
  Conversion conversion;
  conversion.grid = std::move(voxels.grid);
  conversion.fit.end = FitEnd::kCancelled;
  return conversion;
}

/// A conversion to voxels that were chosen instead of ellipsoids with these figures.
Conversion asConversion(VoxelCandidate voxels, const Candidate& ellipsoids, FitEnd end) {
  const ChoiceRecord choice{record(voxels), ellipsoids};
  return asConversion(std::move(voxels), choice, end);
}

/// Records that ellipsoids were taken instead of voxels.
/// \param plateau  the decision of the voxels
void recordRejected(const Decision& plateau, const ChoiceRecord& choice, Conversion& taken) {
  taken.choice = choice;
  taken.decisions.plateau = plateau;
  taken.decisions.plateau.used = false;
}

UsageError tooSmall(const Job& job, std::uint64_t bytes, const std::string& needs) {
  return UsageError("grid '" + shownName(job.input.descriptor.name) + "' " + needs +
                    "; the size allows " + std::to_string(bytes));
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
  VoxelCandidate voxels;  ///< without figures if a cancellation ended their search
  RestOfSearch search;
  double seconds = 0.0;  ///< wall-clock seconds that `search` took before the voxels were known
};

/// The smaller of voxels and ellipsoids, which must reach the PSNR.
Conversion smallerOf(const Job& job, const PsnrTarget& target, PsnrCandidates candidates) {
  VoxelCandidate& voxels = candidates.voxels;
  double& seconds = candidates.seconds;
  const double psnr = target.psnr;
  const auto below = std::uint64_t(target.worthwhileShare * double(voxels.bytes));
  auto [ellipsoids, expected] = fitted(seconds, [&] { return candidates.search(below); });
  ChoiceRecord choice{record(voxels), {}};
  if (expected > 0) choice.ellipsoids = Candidate{expected, psnr, true, seconds};
  if (ellipsoids) {
    choice.ellipsoids = record(job, *ellipsoids, seconds);
    recordRejected(voxels.plateau, choice, *ellipsoids);
    if (choice.ellipsoids->psnr >= psnr && choice.ellipsoids->bytes < voxels.bytes)
      return std::move(*ellipsoids);
  }
  return asConversion(std::move(voxels), choice, FitEnd::kPsnrReached);
}

/// True if exact voxels take at most a number of bytes. If finding out is cancelled, the ellipsoids that
/// are there are taken.
bool takesUnlessCancelled(const Job& job, ExactVoxels& exact, double bytes) {
  const auto takes = unlessCancelled([&]() -> std::optional<bool> {
    if (isCancelled(job)) return std::nullopt;
    return exact.takeAtMost(bytes);
  });
  return takes.value_or(false);
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
    if (ended && !takesUnlessCancelled(job, exact, double(other.bytes))) {
      ellipsoids->choice = ChoiceRecord{exact.figures(), other};
      return std::move(*ellipsoids);
    }
  }
  return asConversion(std::move(exact).take(), other, FitEnd::kPsnrReached);
}

/// The conversion to voxels of a size to which there is no alternative.
Conversion voxelsAlone(VoxelCandidate voxels) {
  const ChoiceRecord choice{record(voxels), {}};
  return asConversion(std::move(voxels), choice, FitEnd::kScheduleDone);
}

Conversion voxelsToSize(const Job& job, std::uint64_t bytes) {
  auto voxels = voxelsForSize(job, bytes).found;
  if (!voxels) throw tooSmall(job, bytes, "has no voxels of that size");
  return voxelsAlone(std::move(*voxels));
}

/// Chooses the better of quantised voxels and ellipsoids of a size. A short fit is made first. Voxels
/// are searched only if they can have the PSNR that this fit lets expect of a full one.
class BetterOfSize {
 public:
  BetterOfSize(const Job& job, std::uint64_t bytes) : job_(job), bytes_(bytes) {}

  Conversion run() {
    const auto search = fitted(seconds_, [&] { return startSizeSearch(job_, bytes_); });
    if (!search.rest) throw Cancelled();
    const double least = search.expected - kUncertainty;
    searchVoxelsUnlessCancelled(least);
    ellipsoids_ = fitted(seconds_, [&] { return search.rest(psnrOfVoxels()); });
    if (ellipsoids_.conversion) figures_ = record(job_, *ellipsoids_.conversion, seconds_);
    if (voxels_.tooLarge && !suffices(least))
      searchVoxelsUnlessCancelled(figures_ ? *figures_->psnr : kAnyPsnr);
    return better();
  }

 private:
  static constexpr double kAnyPsnr = -std::numeric_limits<double>::infinity();

  void searchVoxels(double least) {
    const double before = voxels_.seconds;
    voxels_ = voxelsForSize(job_, bytes_, least);
    voxels_.seconds += before;
  }

  /// Without a result, the ellipsoids are taken.
  void searchVoxelsUnlessCancelled(double least) {
    (void)unlessCancelled([&] {
      searchVoxels(least);
      return true;
    });
  }

  [[nodiscard]] std::optional<double> psnrOfVoxels() const {
    return voxels_.found ? std::optional(voxels_.found->psnr) : std::nullopt;
  }

  /// True if the ellipsoids have a PSNR, or if they were cancelled, so that nothing should be tried
  /// after them.
  [[nodiscard]] bool suffices(double psnr) const {
    if (isCancelled(job_)) return true;
    if (!figures_) return false;
    return *figures_->psnr >= psnr || ellipsoids_.conversion->fit.end == FitEnd::kCancelled;
  }

  [[nodiscard]] ChoiceRecord choice() const {
    ChoiceRecord made{voxels_.tooLarge, figures_};
    if (voxels_.found) made.voxels = record(*voxels_.found);
    if (made.voxels) made.voxels->seconds = voxels_.seconds;
    if (!figures_ && ellipsoids_.expected > 0.0)
      made.ellipsoids = Candidate{bytes_, ellipsoids_.expected, true, seconds_};
    return made;
  }

  Conversion better() {
    const ChoiceRecord record = choice();
    if (figures_ && (!voxels_.found || *figures_->psnr > voxels_.found->psnr)) {
      recordRejected(voxels_.plateau, record, *ellipsoids_.conversion);
      return std::move(*ellipsoids_.conversion);
    }
    if (!voxels_.found && isCancelled(job_)) throw Cancelled();
    if (!voxels_.found) throw tooSmall(job_, bytes_, ellipsoids_.needed);
    return asConversion(std::move(*voxels_.found), record, FitEnd::kScheduleDone);
  }

  const Job& job_;
  std::uint64_t bytes_;
  double seconds_ = 0.0;  ///< Wall-clock seconds that all fits took together.
  VoxelsOfSize voxels_;
  SizeResult ellipsoids_;
  /// The measured bytes and PSNR of ellipsoids_; nothing if no fit was stored.
  std::optional<Candidate> figures_;
};

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

/// What was found before a cancellation: voxels that reach the PSNR, or a short fit.
Conversion bestSoFar(PsnrCandidates candidates) {
  if (candidates.voxels.grid.voxels) return asConversion(std::move(candidates.voxels));
  if (!candidates.search) throw Cancelled();
  auto found = candidates.search(std::nullopt).conversion;
  if (!found) throw Cancelled();
  return std::move(*found);
}

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
  auto coder = std::async(std::launch::async, [&, token = CancelScope::token()] {
    const CancelScope scope(token);
    VoxelCandidate voxels = code();
    if (voxels.bytes < target.smallEnough) notNeeded.cancel();
    return voxels;
  });
  made.search = fitted(made.seconds, [&] { return startPsnrSearch(job, target.psnr, notNeeded); });
  if (auto voxels = unlessCancelled([&] { return std::optional(coder.get()); }))
    made.voxels = std::move(*voxels);
  if (!made.search) made.search = [](auto) { return PsnrResult{}; };
  return made;
}

}  // namespace

Conversion convertToPsnr(const Job& job, const PsnrTarget& target) {
  const Representation wanted = representationOf(job);
  if (wanted == Representation::kEllipsoids)
    return std::move(*searchPsnr(job, target.psnr).conversion);
  if (wanted == Representation::kAuto && isLarge(job)) return smallerOfExactAnd(job, target.psnr);
  auto found = wanted == Representation::kAuto ? psnrCandidates(job, target)
                                               : PsnrCandidates{voxelsForPsnr(job, target), {}};
  if (isCancelled(job)) return bestSoFar(std::move(found));
  if (found.search && found.voxels.bytes >= target.smallEnough)
    return smallerOf(job, target, std::move(found));
  const ChoiceRecord choice{record(found.voxels), {}};
  return asConversion(std::move(found.voxels), choice, FitEnd::kPsnrReached);
}

Conversion convertToSize(const Job& job, std::uint64_t bytes) {
  const Representation wanted = representationOf(job);
  if (wanted == Representation::kEllipsoids) return ellipsoidsToSize(job, bytes);
  if (wanted == Representation::kAuto && isLarge(job)) return exactOrEllipsoids(job, bytes);
  if (auto exact = exactVoxelsWithin(job, bytes)) return voxelsAlone(std::move(*exact));
  return wanted == Representation::kVoxels ? voxelsToSize(job, bytes)
                                           : BetterOfSize(job, bytes).run();
}

Conversion unlessExactIsSmaller(const Job& job, const std::function<Conversion()>& fit) {
  if (representationOf(job) != Representation::kAuto) return fit();
  const double count = double(plannedCount(job.options.fit, activeVoxelCount(job.input.source)));
  ExactVoxels exact(job);
  std::optional<Conversion> fitted;
  double seconds = 0.0;
  if (fitsBesideTheCoder(job)) {
    auto coder = std::async(std::launch::async, [&, token = CancelScope::token()] {
      const CancelScope scope(token);
      return exactVoxels(job);
    });
    fitted = addSeconds(seconds, fit);
    auto coded = unlessCancelled([&] { return std::optional(coder.get()); });
    if (!coded) return std::move(*fitted);
    exact.set(std::move(*coded));
  }
  Candidate ellipsoids{std::uint64_t(kBytesPerEllipsoid * count), {}, true};
  if (fitted || !exact.takeAtMost(kMinBytesPerEllipsoid * count)) {
    if (!fitted) fitted = addSeconds(seconds, fit);
    // Their PSNR would take a decoding.
    ellipsoids = {bytesOfEllipsoids(fitted->grid), {}, false, seconds};
    if (!takesUnlessCancelled(job, exact, double(ellipsoids.bytes))) {
      if (isCancelled(job)) return std::move(*fitted);
      fitted->choice = ChoiceRecord{exact.figures(), ellipsoids};
      return std::move(*fitted);
    }
  }
  return asConversion(std::move(exact).take(), ellipsoids, FitEnd::kScheduleDone);
}

}  // namespace esvr::convert
