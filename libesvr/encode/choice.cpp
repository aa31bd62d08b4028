// Voxels or ellipsoids: goals that both can reach, and single fits.

#include "encode/choice.h"

#include <algorithm>
#include <cmath>
#include <future>
#include <optional>
#include <string>
#include <utility>

#include "core/add_seconds.h"
#include "encode/ellipsoids.h"
#include "encode/voxels.h"
#include "esvr/error.h"
#include "esvr/grid.h"
#include "esvr/metrics.h"

namespace esvr::encode {

namespace {

/// Bytes that a fit on the CPU must be expected to save, compared with voxels, for each brick and iteration. An
/// iteration takes 5 to 15 us for each brick, so that a fit saves at least some 200 bytes in each second. Fits save 0.082 such
/// bytes in smoke1, 0.009 in hydrogen_atom, 0.013 in dragon, and 0.0008 in the shadow of gas_0006, where 1.5 KB took 30 s.
constexpr double kBytesPerWork = 0.002;

Candidate figuresOf(const VoxelCandidate& voxels) {
  return {voxels.bytes, voxels.psnr, false, voxels.seconds};
}

/// A conversion to voxels.
/// \param ellipsoids  the figures of ellipsoids that were considered instead
Conversion asConversion(VoxelCandidate voxels, const std::optional<Candidate>& ellipsoids,
                        FitEnd end) {
  Conversion conversion;
  conversion.choice = ChoiceRecord{figuresOf(voxels), ellipsoids};
  conversion.grid = std::move(voxels.grid);
  conversion.fit.end = end;
  return conversion;
}

}  // namespace

bool isConstant(const SparseVolume& volume) {
  const ValueRange range = activeRange(volume);
  return range.min == range.max;
}

namespace {

/// Completes the ellipsoids or the voxels for a goal that both can reach, whichever are better.
class Choice {
 public:
  Choice(const Job& job, const Aim& goal)
      : job_(job), wanted_(representationOf(job)), goal_(goal), plan_(planOf(job)) {}

  /// \param share        share of the voxels' bytes that ellipsoids must be expected to stay below
  /// \param smallEnough  bytes of voxels below which no ellipsoids are tried, unless they are far smaller
  Conversion forPsnr(double share, std::uint64_t smallEnough) {
    if (wanted_ == Representation::kEllipsoids) return ellipsoidsAlone();
    if (isConstant(job_.input.source) || isBeyondFloats())
      return asConversion(exactVoxels(job_), {}, FitEnd::kPsnrReached);
    voxels_.emplace(job_, goal_);
    if (wanted_ == Representation::kVoxels || *goal_.psnr > kMostOfSums) return completeVoxels();
    if (!plan_.fitsInTime) {
      fitsTookTooLong_ = true;
      return completeVoxels();
    }
    ellipsoids_.emplace(job_, goal_);
    const auto expected = estimateAndDraft(share, smallEnough);
    if (isCancelled(job_)) return bestSoFar();
    if (!ellipsoids_->drafted()) return completeVoxels();
    // An estimate from a sample may be too low or too high.
    const double margin = expected->estimated ? kEstimateMargin : 1.0;
    const auto below = std::uint64_t(margin * share * double(expected->bytes));
    figures_ = Candidate{ellipsoids_->expectedBytes(), *goal_.psnr, true, seconds_};
    if (!ellipsoids_->mayStayBelow(below) ||
        voxels_->likelyBytes(*expected) <
            figures_->bytes + leastSaving(ellipsoids_->expectedWork()))
      return completeVoxels();
    completeEllipsoids();
    const bool reached = conversion_ && *figures_->psnr >= *goal_.psnr;
    if (reached && margin * double(figures_->bytes) < double(expected->bytes))
      return ellipsoidsInsteadOf(expected);
    if (isCancelled(job_)) return bestSoFar();
    auto voxels = finishedVoxels();
    if (!voxels || (reached && figures_->bytes < voxels->bytes))
      return ellipsoidsInsteadOf(voxels ? figuresOf(*voxels) : expected);
    return asConversion(std::move(*voxels), figures_, FitEnd::kPsnrReached);
  }

  Conversion forSize() {
    if (wanted_ == Representation::kEllipsoids) return ellipsoidsAlone();
    voxels_.emplace(job_, goal_);
    if (wanted_ == Representation::kVoxels || exactFits()) return completeVoxels();
    if (leavesOutFits(*goal_.bytes) && voxels_->estimate()) return completeVoxels();
    fitsTookTooLong_ = false;
    ellipsoids_.emplace(job_, goal_);
    seconds_ += secondsOf([&] { ellipsoids_->draft(); });
    figures_ = Candidate{*goal_.bytes, ellipsoids_->expectedPsnr(), true, seconds_};
    std::optional<Candidate> expected, tooLarge;
    (void)unlessCancelled([&] {
      if (isCancelled(job_)) return false;
      tooLarge = voxels_->tooLargeFor(ellipsoids_->expectedPsnr() - kUncertainty);
      if (!tooLarge) expected = voxels_->estimate();
      return true;
    });
    if (expected && !isCancelled(job_) && !ellipsoids_->mayReach(*expected->psnr))
      if (auto voxels = finishedVoxels())
        return asConversion(std::move(*voxels), figures_, FitEnd::kScheduleDone);
    completeEllipsoids();
    const bool isBetter =
        conversion_ &&
        (!expected || *figures_->psnr >= *expected->psnr + (expected->estimated ? kSampleDb : 0.0));
    if (isBetter || (conversion_ && isCancelled(job_)))
      return ellipsoidsInsteadOf(expected ? expected : tooLarge);
    auto voxels = finishedVoxels();
    if (!voxels && !conversion_) refuseSize(ellipsoids_->needed());
    if (!voxels || (conversion_ && *figures_->psnr > voxels->psnr))
      return ellipsoidsInsteadOf(voxels ? figuresOf(*voxels) : expected);
    return asConversion(std::move(*voxels), figures_, FitEnd::kScheduleDone);
  }

 private:
  /// dB by which the PSNR of voxels of a size may be higher than on a sample, whose runs have fewer
  /// neighbours and whose models learn less.
  static constexpr double kSampleDb = 3.0;
  /// PSNR, dB, that sums of ellipsoids in float32 do not reach.
  static constexpr double kMostOfSums = 110.0;
  /// Smallest number of active voxels from which on a GPU makes the short fits while the CPU tries
  /// voxels. Those of smaller volumes are soon tried, and often show that no fit is needed.
  static constexpr std::uint64_t kMinDraftedVoxels = std::uint64_t{1} << 16;

  /// True if only exact voxels have the PSNR: steps of the floats next to the peak have less.
  [[nodiscard]] bool isBeyondFloats() const {
    constexpr double kMostOfFloats = 156.0;
    return *goal_.psnr > kMostOfFloats && !seesPictures(job_);
  }

  /// Bytes that a fit of so much work must save to be worth its time, which on a GPU is short.
  std::uint64_t leastSaving(double work) const {
    if (isOnGpu()) return 0;
    return std::uint64_t(kBytesPerWork * work / effortFactor(job_.options.effort));
  }

  /// Whether no fit is made beside voxels of so many bytes, because it would take too long for the effort. The least effort
  /// makes none where voxels need many bits, because ellipsoids do, too: for the sizes of external_points.md, they were
  /// better up to 2.0 bits for each active voxel, and worse from 3.6 on. For a quality, voxels of more than 1.25 bits cost
  /// nothing but bytes, and a fit takes up to ten times as long. Qualities above or below a preset belong to the search for
  /// the size of several grids.
  bool leavesOutFits(std::uint64_t voxelBytes) {
    constexpr double kBitsForSize = 2.0, kBitsForQuality = 1.25;
    const auto* preset = std::get_if<PresetGoal>(&job_.options.goal);
    const bool isForSize = goal_.bytes || (preset && preset->abovePreset != 0.0);
    const double bits =
        (isForSize ? kBitsForSize : kBitsForQuality) * double(activeVoxelCount(job_.input.source));
    const bool isDetailed = job_.options.effort == kLeastEffort && 8.0 * double(voxelBytes) > bits;
    fitsTookTooLong_ = !plan_.fitsInTime || isDetailed;
    return fitsTookTooLong_;
  }

  bool isOnGpu() const { return job_.options.fit.device.kind == DeviceKind::kCuda; }

  /// \throws Cancelled  nothing was found because the search was cancelled
  [[noreturn]] void refuseSize(std::uint64_t needed) const {
    if (isCancelled(job_)) throw Cancelled();
    const std::string grid = "grid '" + shownName(job_.input.descriptor.name) + "'";
    if (job_.options.fit.narrowBand && wanted_ != Representation::kVoxels)
      throw UsageError(grid +
                       ": ellipsoids and the residual that corrects the signs of the level set do "
                       "not fit into " +
                       std::to_string(*goal_.bytes) + " bytes" +
                       (wanted_ == Representation::kAuto ? ", and voxels neither" : ""));
    const std::string takes = needed > 0 ? "takes at least " + std::to_string(needed) + " bytes"
                                         : "has no voxels of that size";
    throw UsageError(grid + " " + takes + "; the size allows " + std::to_string(*goal_.bytes));
  }

  Conversion ellipsoidsAlone() {
    ellipsoids_.emplace(job_, goal_);
    ellipsoids_->draft();
    auto made = ellipsoids_->run();
    if (!made) refuseSize(ellipsoids_->needed());
    return std::move(*made);
  }

  bool exactFits() {
    const Candidate exact = estimateExactVoxels(job_);
    const double margin = exact.estimated ? kEstimateMargin : 1.0;
    return double(exact.bytes) * margin <= double(*goal_.bytes);
  }

  /// Tries voxels on a sample and makes the short fits: at the same time if a GPU makes these, and one
  /// after the other otherwise, so that the fits know what they have to stay below.
  std::optional<Candidate> estimateAndDraft(double share, std::uint64_t smallEnough) {
    const bool onGpu = isOnGpu() && activeVoxelCount(job_.input.source) >= kMinDraftedVoxels;
    std::optional<Candidate> expected;
    const auto areSmallEnough = [&](const Candidate& voxels) {
      return (voxels.bytes < smallEnough && !voxels_->areFarBehind()) ||
             leavesOutFits(voxels.bytes);
    };
    const auto draft = [&](const CancelToken* cancel) {
      seconds_ += secondsOf([&] {
        (void)unlessCancelled([&] {
          ellipsoids_->draft(cancel);
          return true;
        });
      });
    };
    const auto estimate = [&] {
      return unlessCancelled([&] { return voxels_->estimate(ellipsoids_->scoutedBytes()); });
    };
    if (!onGpu) {
      expected = estimate();
      if (!expected || areSmallEnough(*expected)) return expected;
      ellipsoids_->stayBelow(std::uint64_t(share * double(expected->bytes)));
      draft(nullptr);
      return expected;
    }
    CancelToken notNeeded(job_.options.fit.cancel);
    auto trying = std::async(std::launch::async, [&, token = CancelScope::token()] {
      const CancelScope scope(token);
      auto found = estimate();
      if (found && areSmallEnough(*found)) notNeeded.cancel();
      return found;
    });
    draft(&notNeeded);
    expected = trying.get();
    if (expected) ellipsoids_->stayBelow(std::uint64_t(share * double(expected->bytes)));
    return expected;
  }

  void completeEllipsoids() {
    seconds_ +=
        secondsOf([&] { conversion_ = unlessCancelled([&] { return ellipsoids_->run(); }); });
    if (!conversion_) return;
    const auto& reached = ellipsoids_->reached();
    figures_ = Candidate{bytesOfEllipsoids(conversion_->grid),
                         reached ? *reached : psnrOf(job_, *conversion_), false, seconds_};
  }

  std::optional<VoxelCandidate> finishedVoxels() {
    return unlessCancelled([&] { return voxels_->run(); });
  }

  Conversion completeVoxels() {
    auto voxels = voxels_->run();
    if (!voxels) refuseSize(0);
    Conversion conversion = asConversion(std::move(*voxels), figures_,
                                         goal_.psnr ? FitEnd::kPsnrReached : FitEnd::kScheduleDone);
    if (isCancelled(job_)) conversion.fit.end = FitEnd::kCancelled;
    conversion.fitsTookTooLong = fitsTookTooLong_;
    return conversion;
  }

  Conversion ellipsoidsInsteadOf(const std::optional<Candidate>& voxels) {
    conversion_->choice = ChoiceRecord{voxels, figures_};
    if (conversion_->choice->voxels) conversion_->choice->voxels->seconds = voxels_->seconds();
    return std::move(*conversion_);
  }

  /// What was found before a cancellation: ellipsoids, or voxels that reach the goal.
  Conversion bestSoFar() {
    if (!conversion_ && ellipsoids_->hasDraft()) conversion_ = ellipsoids_->run();
    if (conversion_) return std::move(*conversion_);
    return completeVoxels();
  }

  const Job& job_;
  Representation wanted_;
  Aim goal_;
  Plan plan_;
  double seconds_ = 0.0;  ///< wall-clock seconds that all fits took together
  bool fitsTookTooLong_ = false;
  std::optional<VoxelSearch> voxels_;
  std::optional<EllipsoidSearch> ellipsoids_;
  std::optional<Conversion> conversion_;  ///< to ellipsoids
  std::optional<Candidate> figures_;      ///< expected or measured figures of the ellipsoids
};

}  // namespace

Conversion convertToQuality(const Job& job, double quality, const Worthwhile& worthwhile) {
  return Choice(job, {.psnr = quality}).forPsnr(worthwhile.share, worthwhile.smallEnough);
}

Conversion convertToSize(const Job& job, std::uint64_t bytes) {
  return Choice(job, {.bytes = bytes}).forSize();
}

Conversion fitOrExact(const Job& job) {
  FitOptions options = job.options.fit;
  if (!options.iterations && job.options.effort != kUsualEffort)
    options.iterations =
        std::uint32_t(std::ceil(effortFactor(job.options.effort) * plannedIterations(options)));
  double seconds = 0.0;
  const auto fitted = [&] {
    return addSeconds(seconds, [&] {
      FitResult made = fit(job.input.source, options);
      StoredGrid grid = storedGridOf(job, made);
      grid.curve = withoutTimes(made.curve);
      return storedAs(job, std::move(made), std::move(grid),
                      {.loss = CompactOptions{}.loss, .psnr = options.psnr});
    });
  };
  if (representationOf(job) != Representation::kAuto) return fitted();
  const double count = double(plannedCount(options, activeVoxelCount(job.input.source)));
  const Candidate expected = estimateExactVoxels(job);
  std::optional<VoxelCandidate> exact;
  const auto exactWithin = [&](double bytes) {
    if (double(expected.bytes) > (expected.estimated ? kEstimateMargin : 1.0) * bytes) return false;
    if (!exact) exact = unlessCancelled([&] { return std::optional(exactVoxels(job)); });
    return exact && double(exact->bytes) <= bytes;
  };
  if (exactWithin(kLeastBytesEach * count))
    return asConversion(std::move(*exact),
                        Candidate{std::uint64_t(kUsualBytesEach * count), {}, true},
                        FitEnd::kScheduleDone);
  Conversion conversion = fitted();
  if (isCancelled(job)) return conversion;
  // Their PSNR would take a decoding.
  const Candidate ellipsoids{bytesOfEllipsoids(conversion.grid), {}, false, seconds};
  if (exactWithin(double(ellipsoids.bytes)))
    return asConversion(std::move(*exact), ellipsoids, FitEnd::kScheduleDone);
  conversion.choice = ChoiceRecord{exact ? figuresOf(*exact) : expected, ellipsoids};
  return conversion;
}

}  // namespace esvr::encode
