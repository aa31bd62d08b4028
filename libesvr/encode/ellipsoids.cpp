#include "encode/ellipsoids.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/parallel.h"
#include "encode/tone.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"
#include "esvr/resolution.h"

namespace esvr::encode {

// ---- Fits

namespace {

// How ellipsoids grow with their number. "Lab" refers to docs/lab-notes.md.

/// Active voxels per ellipsoid of the first guess for a PSNR.
constexpr double kVoxelsOfFirstGuess = 35.0;
/// The price of an ellipsoid in a short fit relative to that in a whole one.
constexpr double kShortFitPrice = 0.94;
/// PSNR of a whole fit of 400 iterations less that of a short one of 100, dB: smoke1 and wdas have 1.3 to 1.6. Where many
/// voxels saturate it is 5 to 6 (dragon, aneurism), since a clamped voxel has no gradient. Of tones, smoke1 has 0.4 to 0.9,
/// judged by what is seen.
constexpr double kShortFitBehind = 1.6, kShortFitBehindSaturated = 5.0, kTonedShortFitBehind = 0.8;
/// The steepest growth of the PSNR by twice the ellipsoids, dB (aneurism has 6.7).
constexpr double kSteepestDbPerDoubling = 7.0;
/// Usual growth of what is seen of tones by twice the ellipsoids, dB: smoke1 has 2.9 to 3.4, the plume of 256 3.4,
/// hydrogen_atom 2.3 to 4.2. Of values, and of the short fits of large volumes, it is kDbPerDoubling (plume of 640: 5.4).
constexpr double kTonedDbPerDoubling = 3.0;
/// dB by which a fit with both signs must be better to be taken (Lab, "Signs"). Terms that cancel each other need more bits.
constexpr double kSignsGain = 0.5;

// How long fits are, as shares of the iterations of a whole one: a fit that continues an earlier one (Lab, "Continued fits"),
// one that continues the frame before (Lab, "Frames that continue"), and one from seeds for a size, unless many voxels
// saturate.
constexpr double kContinuedShare = 0.4, kContinuedFrameShare = 0.3, kSizedShare = 0.6;

/// The share of the iterations of a whole fit for which a probe continues a short one, the factor of the iterations of short
/// fits from which on there is one, and the growth of the quality in whole fits relative to short ones (Lab, "Probes").
constexpr double kProbeShare = 0.17, kSteeperWhenProbed = 1.25;
constexpr std::uint32_t kLongFit = 8;
/// The share of the iterations of Preset::kHigh that its whole fits have: 3000 ellipsoids of the plume of 256 have 47.9, 50.3, 51.3
/// and 51.5 dB of what is seen after 100, 400, 1000 and 2000.
constexpr double kShareOfLongFit = 0.6;

/// Bytes of ellipsoids from which on a whole fit has all iterations. It saves about a fifth of the bytes of a short one,
/// which for fewer bytes is worth less time in proportion (hydrogen_atom: 560 bytes in 12 CPU seconds with all iterations).
constexpr double kBytesOfWholeFit = 4096.0;

/// Of values (Lab, "More ellipsoids or more bits"), and of tones: smoke1 of 25 KB has 34.8 dB of what is
/// seen with these, and 34.5 with those of values.
constexpr Rounding kRounding{0.9, 2.5, 1.0}, kTonedRounding{0.5, 1.2, 1.65};

// Where a search goes.

/// A fit continues an earlier one if it has 0.85 to 1.8 times the ellipsoids of that. Where more are dropped, a fit from
/// seeds is better (dragon, 0.6 times as many: 49.4 dB, and 47.3 dB continued). With 1.5 instead of 1.8, more short fits
/// are made (Lab, "Where a search goes").
constexpr double kLeastGrowth = 0.85, kMostGrowth = 1.8;
/// A continued fit of fewer ellipsoids starts from this share of them, and a short fit has this share
/// of the expected number. New ones then find the places that miss those that were dropped.
constexpr double kGrownFrom = 0.9;
/// A short fit is extrapolated up to this factor of its number, so that a whole one can continue it. At most so many short
/// fits are made to come that near.
constexpr double kNear = kMostGrowth * kGrownFrom;
constexpr int kMostDrafts = 3;
/// Whole fits of ellipsoids that take at most half of kBytesOfWholeFit, each of which has at most half of the iterations.
constexpr int kMostSmallFits = 4;
/// A fit for a PSNR is far above it where it exceeds the largest margin by this factor. By the usual growth, it has at least
/// twice the ellipsoids that it needs.
constexpr double kFarAbove = 2.0;
/// Largest number of ellipsoids of the first of them. Where it is farther from the PSNR than kFar times its number of
/// ellipsoids, one with as many times fewer shows the slope.
constexpr double kMostOfFirstDraft = 6000.0, kFar = 4.0;
/// Largest number of ellipsoids of a fit that scouts before them, in volumes of up to 20,000 and from 40,000 bricks on.
constexpr double kMostOfScout = 1000.0, kMostOfLargeScout = 2000.0, kBricksOfScout = 20.0;
/// Largest factor of the number between two fits, and the smallest of a fit that follows a missed PSNR.
constexpr double kMaxGrowth = 8.0, kGrowthAfterMiss = 1.03;
/// Active voxels for each ellipsoid and number of ellipsoids from which on fits to averages are tried, the largest number of
/// iterations of a whole one, and the largest share of the squared error that averaging may have (Lab, "Fits to averages").
/// Fits of fewer ellipsoids take little time, and one more or less decides.
constexpr double kVoxelsOfAverages = 800.0, kFewestOfAverages = 200.0, kMostOfAveraging = 0.5;
constexpr std::uint32_t kMostIterationsOfAverages = 1000;
/// Bytes of the residual of the signs of a narrow band with a whole fit, relative to those with a short one (Lab, "Signs of a size").
constexpr double kSignsOfWholeFit = 0.75;
/// Limits of the loss by rounding for a judge, dB over the box.
constexpr double kLeastLoss = 0.02, kMostRoundingLoss = 5.0;
/// Factor by which a whole fit of tones may be expected to gain more than one of 400 iterations over one of 100.
constexpr double kMostBehind = 2.5;
/// Bounds on the slope between two short fits, whose PSNR is known to a few tenths of a dB.
constexpr double kMinSlopeRatio = 1.15, kMinSlope = kDbPerDoubling / 2.0;

constexpr Margin kFloat32Margin{0.3, 0.0, 0.9};
// Of twelve first fits that were 1.9 to 3.1 dB above their PSNR, those up to 2.3 dB were rounded to fewer bytes than a
// second fit took, or to at most 6 % more, and those above 2.8 dB to 7 to 38 % more.
Margin compactMargin(double usualLoss) { return {usualLoss, 0.39 * usualLoss, 2.5 * usualLoss}; }

FitPoint pointOf(const Attempt& a) { return {double(a.asked), a.psnr}; }

/// The number of ellipsoids with which fits should have a PSNR: between the nearest ones below and above it, or by a slope
/// in dB per doubling from the nearest one.
double countFor(const std::vector<FitPoint>& fits, double psnr, double slope) {
  const FitPoint *low = nullptr, *high = nullptr, *nearest = &fits.front();
  for (const FitPoint& fit : fits) {
    const FitPoint*& side = fit.psnr < psnr ? low : high;
    const bool isNearer =
        !side || (fit.psnr < psnr ? fit.count > side->count : fit.count < side->count);
    if (isNearer) side = &fit;
    if (std::abs(fit.psnr - psnr) < std::abs(nearest->psnr - psnr)) nearest = &fit;
  }
  const bool isBetween = low && high && low->count < high->count && std::isfinite(low->psnr) &&
                         std::isfinite(high->psnr);
  // Where all fits have far more ellipsoids than they need, one of fewer may be the better one (diffuse-scalar).
  if (!low || !high) nearest = low ? low : high;
  if (!isBetween) return nearest->count * std::exp2((psnr - nearest->psnr) / slope);
  const double share = (psnr - low->psnr) / (high->psnr - low->psnr);
  return low->count * std::pow(high->count / low->count, share);
}

/// The PSNR that such fits should have with a number of ellipsoids: that of the nearest one, moved by a slope.
double psnrFor(const std::vector<FitPoint>& fits, double count, double slope) {
  const auto distance = [&](const FitPoint& fit) { return std::abs(std::log(fit.count / count)); };
  const auto nearest = std::ranges::min_element(fits, {}, distance);
  return nearest->psnr + slope * std::log2(count / nearest->count);
}

}  // namespace

EllipsoidSearch::EllipsoidSearch(const Job& job, const Aim& goal, const StoredGrid* before)
    : options_(job.options),
      job_{job.input, options_, job.judge, job.scout},
      goal_(goal),
      before_(before),
      plan_(planOf(job)),
      compact_(job.options.storage.form == Storage::kCompact),
      saturates_(saturates(job.input.source)),
      rounding_(isToned(job) ? kTonedRounding : kRounding),
      margin_(compact_ ? compactMargin(rounding_.usualLoss * rounding_.factor) : kFloat32Margin),
      slope_(isToned(job_) && plan_.improves ? kTonedDbPerDoubling : kDbPerDoubling),
      maxCount_(activeVoxelCount(job.input.source)) {
  if (goal.psnr && options_.fit.count)
    maxCount_ = std::min<std::uint64_t>(maxCount_, *options_.fit.count);
}

void EllipsoidSearch::stayBelow(std::uint64_t bytes) {
  below_ = bytes;
  maxCount_ = std::min(maxCount_, std::uint64_t(double(bytes) / kLeastBytesEach) + 1);
}

namespace {

/// The number of ellipsoids of the first short fit for a size, and for a PSNR.
double firstCount(const Job& job) {
  if (const auto* size = std::get_if<SizeGoal>(&job.options.goal))
    return kGrownFrom * double(size->bytes) / kUsualBytesEach;
  return std::min(double(activeVoxelCount(job.input.source)) / kVoxelsOfFirstGuess,
                  kMostOfFirstDraft);
}

}  // namespace

double scoutCount(const Job& job) {
  const double most = std::clamp(double(job.input.source.brickCount()) / kBricksOfScout,
                                 kMostOfScout, kMostOfLargeScout);
  return std::min(firstCount(job), most);
}

Attempt EllipsoidSearch::shortFit(double count) const {
  return attempted(job_, optionsFor(job_, count, plan_.shortIterations));
}

/// The attempt whose number of ellipsoids is nearest to a number and from which a fit can continue;
/// null if there is none.
const Attempt* EllipsoidSearch::startFor(double count) const {
  const Attempt* start = nullptr;
  const auto distance = [&](const Attempt& a) { return std::abs(std::log(countOf(a) / count)); };
  // Ellipsoids that are left where others were dropped have more wrong signs than those from seeds.
  const double least = signs_ > 0 ? 1.0 : kLeastGrowth;
  const auto consider = [&](const Attempt& a) {
    const double growth = count / countOf(a);
    // What filled the memory of a GPU would have no room to begin with.
    if (a.cancelled() || a.fit.deviceFull || growth < least || growth > kMostGrowth) return;
    if (!start || distance(a) <= distance(*start)) start = &a;
  };
  // Where many voxels saturate, a continued fit is worse (dragon: 46.8 dB instead of 48.1).
  if (draft_ && !saturates_) consider(*draft_);
  for (const Attempt& a : attempts_) consider(a);
  return start;
}

std::uint32_t EllipsoidSearch::shareOfWhole(double share) const {
  return std::max(std::uint32_t(share * plan_.wholeIterations), 1u);
}

/// A whole fit. Where it can continue an earlier one, it adds ellipsoids or drops the weakest, and has
/// fewer iterations. The first fit for a size begins with seeds: of as many iterations, these give a
/// better fit than a short one does (a plume of 20 KB: 0.7 dB), but one that is less like its forecast,
/// by which a PSNR is found with one fit less.
Attempt EllipsoidSearch::wholeFit(double count) const {
  FitOptions options = optionsFor(job_, count, plan_.wholeIterations);
  const Attempt* from = startFor(double(*options.count));
  const bool isShort = from && draft_ && from == &*draft_;
  if (goal_.bytes && (!from || isShort)) {
    if (!saturates_) options.iterations = shareOfWhole(kSizedShare);
    return attempted(job_, options);
  }
  if (!from) return attempted(job_, options);
  return continued(from->grid, count, kContinuedShare);
}

/// A fit that continues other ellipsoids. It adds some, or drops the weakest first.
/// \param share  its share of the iterations of a whole fit
Attempt EllipsoidSearch::continued(const StoredGrid& from, double count, double share) const {
  FitOptions options = optionsFor(job_, count, shareOfWhole(share));
  const auto begins = std::size_t(kGrownFrom * double(*options.count));
  const bool grows = begins >= from.field.ellipsoidCount();
  const StoredGrid fewer = grows ? StoredGrid{} : heaviest(from, begins);
  options.start = grows ? &from.field : &fewer.field;
  return attempted(job_, options);
}

CompactResult EllipsoidSearch::compacted(const Attempt& attempt, CompactOptions target) const {
  return compactedTo(job_, attempt.grid, attempt.fit, target);
}

/// The steps of the frame before, made finer or coarser for a loss in dB; nothing if they are not known. The error that they
/// add grows with the square of the steps.
std::optional<QuantiserSteps> EllipsoidSearch::stepsOfFrameBefore(double loss) const {
  const auto& before = options_.previousCompact;
  if (!before_ || !before) return std::nullopt;
  const auto added = [](double dB) {
    return std::pow(10.0, std::max(dB, kLeastLoss) / 10.0) - 1.0;
  };
  return finer(before->steps, 0.5 * std::log2(added(before->loss) / added(loss)));
}

/// The smallest conversion of an attempt with the PSNR of the goal. A judge's PSNR loses about as many dB as that over the
/// box, which rate control knows, and is measured.
Conversion EllipsoidSearch::storedForPsnr(Attempt attempt) {
  if (!job_.judge || !compact_)
    return storedAs(job_, std::move(attempt.fit), std::move(attempt.grid), {.psnr = goal_.psnr});
  const double loss =
      std::clamp((attempt.psnr - *goal_.psnr) / rounding_.factor, kLeastLoss, kMostRoundingLoss);
  reached_.reset();
  CompactResult made = roundedBy(
      job_, attempt.grid, attempt.fit, {.loss = loss}, [&](const CompactOptions& options) {
        Compactor compactor(attempt.grid, job_.input.source, options);
        auto found = compactor.toQuality(
            {*goal_.psnr, rounding_.factor * loss,
             [&](CompactResult& rounded) { return completed(attempt, rounded); },
             stepsOfFrameBefore(loss)});
        reached_ = found.quality;
        return std::move(found.result);
      });
  if (!reached_) reached_ = completed(attempt, made);
  if (*reached_ < *goal_.psnr && !attempt.cancelled()) attempt.fit.end = FitEnd::kPsnrMissed;
  return conversionOf(std::move(attempt.fit), std::move(made));
}

/// The quality that an attempt has after rounding. A grid that is seen gets the mass of its source.
double EllipsoidSearch::completed(const Attempt& attempt, CompactResult& rounded) const {
  const auto judged = unlessCancelled([&]() -> std::optional<double> {
    if (!job_.judge) return std::nullopt;
    return keepMass(job_, rounded.grid);
  });
  return judged.value_or(attempt.psnr - rounding_.factor * rounded.loss);
}

// ---- Short fits

std::optional<double> EllipsoidSearch::scoutedBytes() const {
  if (!job_.scout || !std::isfinite(job_.scout->psnr)) return std::nullopt;
  return kUsualBytesEach * countFor({*job_.scout}, *goal_.psnr, slope_);
}

/// Quality of a whole fit less that of a short one, dB.
double EllipsoidSearch::behind() const {
  if (before_ || isProbed_) return 0.0;
  const double whole = plan_.wholeIterations, brief = plan_.shortIterations;
  if (!isToned(job_)) {
    const double usual = saturates_ ? kShortFitBehindSaturated : kShortFitBehind;
    return usual * std::clamp(0.5 * std::log2(whole / brief), 0.0, 1.0);
  }
  // The error that iterations leave falls with their number: the plume of 256 has 168 and 42 of them.
  const auto gain = [](double from, double to) { return 1.0 / from - 1.0 / to; };
  const double most = kMostShortIterations;
  return kTonedShortFitBehind * std::min(gain(brief, whole) / gain(most, 4.0 * most), kMostBehind);
}

double EllipsoidSearch::aim() const { return *goal_.psnr + margin_.aim; }

double EllipsoidSearch::capped(double count) const {
  return std::clamp(count, 1.0, double(std::max<std::uint64_t>(maxCount_, 1)));
}

/// The number of ellipsoids with which the next whole fit should reach the PSNR. Whole fits are better than short ones by
/// what the last of them has shown. Those after the first aim at the middle of the margin, since a search ends with them.
double EllipsoidSearch::nextCount() const {
  std::vector<FitPoint> fits = drafted_;
  double above = behind();
  if (!attempts_.empty()) {
    const FitPoint last = pointOf(attempts_.back());
    const double more = last.psnr - psnrFor(fits, last.count, slope_);
    above = std::isfinite(more) ? std::max(more, 0.0) : 0.0;
    // By how much differs with the number of ellipsoids.
    std::erase_if(fits, [&](const FitPoint& fit) {
      return std::abs(std::log2(fit.count / last.count)) > std::log2(kNear);
    });
  }
  for (FitPoint& fit : fits) fit.psnr += above;
  for (const Attempt& a : attempts_) fits.push_back(pointOf(a));
  const double wanted = attempts_.empty() ? margin_.aim : 0.5 * (margin_.min + margin_.max);
  const double count = countFor(fits, *goal_.psnr + wanted, slope_),
               near = double(attempts_.empty() ? draft_->asked : attempts_.back().asked);
  return std::clamp(count, near / kMaxGrowth, near * kMaxGrowth);
}

/// Takes the growth of the PSNR from the last short fit to another one.
void EllipsoidSearch::learnFrom(const Attempt& other) {
  drafted_.push_back(pointOf(other));
  const double doublings = std::log2(countOf(other) / countOf(*draft_));
  if (std::abs(doublings) < std::log2(kMinSlopeRatio)) return;
  slopeIsKnown_ = true;
  slope_ =
      std::clamp((other.psnr - draft_->psnr) / doublings, kMinSlope, 2.0 * kSteepestDbPerDoubling);
}

/// The number of ellipsoids of the first short fit for a PSNR.
double EllipsoidSearch::firstCountForPsnr() const {
  if (job_.scout) {
    const double count = countFor({*job_.scout}, aim() - behind(), slope_),
                 near = job_.scout->count;
    return kGrownFrom * std::clamp(count, near / kMaxGrowth, near * kMaxGrowth);
  }
  const double guess = firstCount(job_);
  // Where ellipsoids win, they usually take about half of the bytes.
  return below_ ? std::min(guess, 0.5 * double(*below_) / kUsualBytesEach) : guess;
}

// Large ellipsoids are fitted to averages, whose iterations take a seventh of the time. Iterations of all voxels after
// them gain nothing (Lab, "Fits to averages").

/// True if ellipsoids may be so large that averages show them as well as voxels do.
bool EllipsoidSearch::mayFitAverages(double count) const {
  const FitOptions& fit = options_.fit;
  const double voxels = double(activeVoxelCount(job_.input.source));
  return !fit.box && !options_.filled && !fit.narrowBand && !saturates_ &&
         count >= kFewestOfAverages && voxels >= kVoxelsOfAverages * count;
}

namespace {

/// The share of the squared error of a fit to averages that is due to the averaging: its error over the averages is less
/// by the variance within these.
double shareOfAveraging(const Attempt& attempt) {
  return 1.0 - std::pow(10.0, (attempt.psnrOfVoxels - lastPsnr(attempt.fit)) / 10.0);
}

}  // namespace

/// Whether averages will do for the quality of the goal, by the short fit. The error that is due to them stays.
bool EllipsoidSearch::averagesSuffice() const {
  if (!job_.averages || draft_->cancelled()) return true;
  const double less = (aim() - draft_->psnr) / rounding_.factor;  // dB over the box
  return shareOfAveraging(*draft_) * std::pow(10.0, less / 10.0) <= kMostOfAveraging;
}

void EllipsoidSearch::fitAverages() {
  averages_ = coarsened(job_.input.source, kAveraged);
  job_.averages = &averages_;
  plan_ = planOf(job_);
  plan_.wholeIterations = std::min(plan_.wholeIterations, kMostIterationsOfAverages);
}

/// Makes all further fits to the voxels themselves, with no more iterations than were planned for few bytes.
void EllipsoidSearch::fitVoxels() {
  job_.averages = nullptr, averages_ = {};
  const Plan plan = planOf(job_);
  plan_.wholeIterations = std::min(plan_.wholeIterations, plan.wholeIterations);
  plan_.shortIterations = std::min(plan_.shortIterations, plan.shortIterations);
  plan_.improves = plan.improves;
}

void EllipsoidSearch::draftFirst() {
  const double count = capped(firstCountForPsnr());
  if (mayFitAverages(count)) fitAverages();
  draft_ = shortFit(count);
  if (!averagesSuffice()) {
    job_.scout = pointOf(*draft_);
    fitVoxels();
    plan_ = planOf(job_);
    draft_ = shortFit(capped(firstCountForPsnr()));
  }
  drafted_ = {pointOf(*draft_)};
}

/// A short fit whose number of ellipsoids is near the one that the PSNR needs. The first guess can be
/// far from it, where signs and prices differ.
void EllipsoidSearch::draftNearPsnr() {
  draftFirst();
  const auto next = [&] { return capped(kGrownFrom * nextCount()); };
  const auto another = [&](double count) {
    auto made = unlessCancelled([&]() -> std::optional<Attempt> { return shortFit(count); });
    if (!made) draft_->fit.end = FitEnd::kCancelled;
    return made;
  };
  for (int drafts = 1;; ++drafts) {
    if (draft_->fit.deviceFull) {  // no fit can have more, and seeds of more could not even begin
      maxCount_ = std::min<std::uint64_t>(maxCount_, draft_->asked);
      return;
    }
    if (drafts == kMostDrafts) return;
    isTooLarge_ = !mayStayBelow(below_.value_or(UINT64_MAX));
    if (draft_->cancelled() || isTooLarge_) return;
    if (!slopeIsKnown_ && !isToned(job_) && next() > kFar * countOf(*draft_)) {
      const auto fewer = another(countOf(*draft_) / kFar);
      if (!fewer) return;
      learnFrom(*fewer);
      isTooLarge_ = !mayStayBelow(below_.value_or(UINT64_MAX));
      if (isTooLarge_) return;
    }
    const double count = next(), ratio = count / countOf(*draft_);
    if (std::max(ratio, 1.0 / ratio) <= kNear) return;
    auto nearer = another(count);
    if (!nearer) return;
    learnFrom(*nearer);
    draft_ = std::move(nearer);
  }
}

/// The number of ellipsoids of a frame. With that of the frame before, rounding would lose as much as there; where this is
/// more than usual, fewer ellipsoids will do, and where it is less, a few more are needed.
double EllipsoidSearch::countOfFrame(const StoredGrid& before) const {
  const auto& rounded = options_.previousCompact;
  const double spare = rounded ? rounding_.factor * (rounded->loss - rounding_.usualLoss) : 0.0;
  const double change =
      std::clamp(std::exp2(-0.5 * spare / slope_), kLeastGrowth, 1.0 / kLeastGrowth);
  return capped(change * double(before.field.ellipsoidCount()));
}

/// A fit that continues the ellipsoids of the frame before takes the place of the short ones, and is the first whole one.
void EllipsoidSearch::continueFrame() {
  const StoredGrid& before = *before_;
  const auto hasNegative = [](const Chunk& chunk) {
    return std::ranges::any_of(chunk.ellipsoids.intensity, [](float i) { return i < 0.0f; });
  };
  if (!options_.fit.bothSigns)
    options_.fit.bothSigns = std::ranges::any_of(before.field.chunks, hasNegative);
  const double bytes = double(bytesOfEllipsoids(before));
  const double share = kContinuedFrameShare * std::min(1.0, bytes / kBytesOfWholeFit);
  const double count = countOfFrame(before);
  if (mayFitAverages(count)) fitAverages();
  draft_ = continued(before, count, share);
  if (!averagesSuffice()) {
    fitVoxels();
    plan_ = planOf(job_);
    draft_ = continued(before, count, share);
  }
  drafted_ = {pointOf(*draft_)};
  attempts_ = {*draft_};
}

/// Decides whether intensities have both signs, unless the options say so: where many voxels have an
/// extreme value and the volume is no narrow band, another short fit with both signs is compared.
void EllipsoidSearch::decideSigns() {
  FitOptions& fit = options_.fit;
  if (draft_->cancelled() || fit.bothSigns || fit.narrowBand || !saturates_) return;
  auto found = unlessCancelled([&]() -> std::optional<Attempt> {
    fit.bothSigns = true;
    Attempt both = shortFit(double(draft_->asked));
    if (both.psnr < draft_->psnr + kSignsGain) return std::nullopt;
    return both;
  });
  fit.bothSigns = found.has_value();
  if (found) draft_ = std::move(found), drafted_ = {pointOf(*draft_)};
  if (isCancelled(job_)) draft_->fit.end = FitEnd::kCancelled;
}

/// Takes the price of an ellipsoid and the bytes of the other sections from the short fit. The price is
/// known to a quarter without a search for the best steps, which decides enough for a PSNR. The number of
/// ellipsoids of a size follows from it. In a frame, the price is that of the frame before.
void EllipsoidSearch::forecast() {
  if (draft_->cancelled() || !compact_) return;
  if (before_) {
    price_ = double(bytesOfEllipsoids(*before_)) / double(before_->field.ellipsoidCount());
  } else {
    const bool isQuick = goal_.psnr.has_value();
    CompactResult compact =
        compacted(*draft_, {.loss = rounding_.usualLoss, .layerErrors = false, .quick = isQuick});
    price_ = std::max(double(compact.bytes) / countOf(*draft_), 1.0) / kShortFitPrice;
    addSigns(compact);
    besides_ = bytesOfEllipsoids(compact.grid) - compact.bytes + paddingOf(compact) - signs_;
    signs_ = std::uint64_t(kSignsOfWholeFit * double(signs_));
    besides_ += signs_;
  }
  const double bytes =
      goal_.psnr ? price_ * countFor(drafted_, aim() - behind(), slope_) : double(*goal_.bytes);
  const double share = std::min(1.0, bytes / kBytesOfWholeFit);
  // Of a few ellipsoids, one more or less may miss a PSNR (hydrogen_atom with 40 dB), and fits are short.
  if (share <= 0.5) plan_.wholeFits = std::max(plan_.wholeFits, kMostSmallFits);
  plan_.probes = plan_.probes && goal_.psnr && share == 1.0 && !saturates_;
  const bool isLong = plan_.probes && !options_.fit.iterations;
  const double iterations = (isLong ? kShareOfLongFit : share) * plan_.wholeIterations;
  plan_.wholeIterations =
      std::max(std::min(plan_.shortIterations, plan_.wholeIterations), std::uint32_t(iterations));
  if (goal_.psnr)
    expectedBytes_ =
        std::uint64_t(double(besides_) + price_ * countFor(drafted_, aim() - behind(), slope_));
}

void EllipsoidSearch::draft(const CancelToken* cancel) {
  const CancelToken* own = options_.fit.cancel;
  if (cancel) options_.fit.cancel = cancel;
  if (before_)
    continueFrame();
  else if (goal_.psnr)
    draftNearPsnr();
  else
    draft_ = shortFit(firstCount(job_));
  if (!before_ && (!below_ || mayStayBelow(*below_))) decideSigns();
  forecast();
  options_.fit.cancel = own;
}

double EllipsoidSearch::expectedPsnr() const {
  return draft_->psnr + (draft_->cancelled() ? 0.0 : behind()) -
         rounding_.usualLoss * rounding_.factor;
}

double EllipsoidSearch::expectedWork() const {
  const SparseVolume& fitted = job_.averages ? *job_.averages : job_.input.source;
  const std::uint32_t iterations =
      startFor(capped(nextCount())) ? shareOfWhole(kContinuedShare) : plan_.wholeIterations;
  return double(iterations) * double(fitted.brickCount());
}

bool EllipsoidSearch::mayReach(double psnr) const {
  return draft_->cancelled() || expectedPsnr() + kUncertainty >= psnr;
}

bool EllipsoidSearch::mayStayBelow(std::uint64_t bytes) const {
  if (draft_->cancelled()) return true;
  if (isTooLarge_) return false;
  const double least = aim() - behind() - kUncertainty;
  const bool isKnown = slopeIsKnown_ || expectedBytes_ > 0;
  const double fewest = least > draft_->psnr ? kSteepestDbPerDoubling : kMinSlope;
  const double count = countFor(drafted_, least, isKnown ? slope_ : fewest);
  return count <= double(maxCount_) && double(besides_) + price_ * count <= double(bytes);
}

// ---- Whole fits

std::optional<Conversion> EllipsoidSearch::run() {
  reached_.reset();
  return goal_.psnr ? runToPsnr() : runToSize();
}

/// The smallest number of ellipsoids of the next whole fit. Of few, one or two decide, so that the last fit that may be made
/// has more than those before if none of them can be rounded to the PSNR.
double EllipsoidSearch::leastAfterMisses() const {
  double most = 0.0;
  for (const Attempt& a : attempts_) {
    if (a.psnr >= *goal_.psnr + margin_.min) return 1.0;
    most = std::max(most, double(a.asked));
  }
  return attempts_.empty() ? 1.0 : std::ceil(kGrowthAfterMiss * most) + 1.0;
}

/// True if no further fit is made for a PSNR: the last one is as good as it should be, or has all that there is.
bool EllipsoidSearch::isEnough() const {
  if (attempts_.empty()) return false;
  const Attempt& last = attempts_.back();
  const double over = last.psnr - *goal_.psnr;
  if (over < margin_.min) return last.fit.deviceFull || double(last.asked) >= capped(HUGE_VAL);
  return over <= margin_.max || !plan_.improves;
}

/// The number of whole fits after which the search ends. The fits that follow one far above the PSNR have a fraction of its
/// ellipsoids, and take a fraction of its time and of its bytes.
int EllipsoidSearch::mostWholeFits() const {
  const bool isFarAbove =
      !attempts_.empty() && attempts_.back().psnr - *goal_.psnr > kFarAbove * margin_.max;
  return isFarAbove ? std::max(plan_.wholeFits, kMostSmallFits) : plan_.wholeFits;
}

/// True if whole fits have so many iterations that a short fit says little of them.
bool EllipsoidSearch::mayProbe() const {
  return plan_.probes && !isProbed_ && !before_ && !job_.averages && !draft_->cancelled() &&
         plan_.wholeIterations >= kLongFit * plan_.shortIterations;
}

/// Continues the last short fit for a share of the iterations of a whole one, and forecasts from there. A whole fit with the
/// number of ellipsoids that the short one asked for would take several times as long, and be far above the PSNR.
void EllipsoidSearch::probe() {
  auto made = unlessCancelled(
      [&] { return std::optional(continued(draft_->grid, double(draft_->asked), kProbeShare)); });
  if (!made) return;
  draft_ = std::move(made);
  drafted_ = {pointOf(*draft_)};
  slope_ *= kSteeperWhenProbed;
  isProbed_ = true;
}

/// A short fit that has all iterations of a whole one is the first of the whole fits.
std::optional<Conversion> EllipsoidSearch::runToPsnr() {
  if (mayProbe()) probe();
  if (!draft_->cancelled() && attempts_.empty() && plan_.wholeIterations <= plan_.shortIterations)
    attempts_.push_back(*draft_);
  for (int fits = 0; fits < mostWholeFits() && !draft_->cancelled() && !isEnough(); ++fits) {
    const bool isMissed = !attempts_.empty() && leastAfterMisses() > 1.0;
    if (isMissed && job_.averages && shareOfAveraging(attempts_.back()) > kMostOfAveraging)
      fitVoxels();
    const double count = capped(std::max(std::floor(nextCount()), leastAfterMisses()));
    const bool isRepeated =
        std::ranges::any_of(attempts_, [&](const Attempt& a) { return double(a.asked) == count; });
    if (isRepeated) break;
    auto found = unlessCancelled([&]() -> std::optional<Attempt> { return wholeFit(count); });
    if (!found)
      for (Attempt& a : attempts_) a.fit.end = FitEnd::kCancelled;
    if (!found) break;
    attempts_.push_back(std::move(*found));
    if (attempts_.back().cancelled()) break;
  }
  if (attempts_.empty()) {
    draft_->fit.end = FitEnd::kCancelled;
    return storedForPsnr(std::move(*draft_));
  }
  return smallestOrBest();
}

/// The smallest conversion of the attempts that reach the PSNR; otherwise the best one, as missed.
Conversion EllipsoidSearch::smallestOrBest() {
  const auto worse = [](const Attempt& a, const Attempt& b) { return a.psnr < b.psnr; };
  // A cancelled fit that has just begun is worse than the short one before it.
  if (std::ranges::any_of(attempts_, &Attempt::cancelled)) {
    attempts_.push_back(*draft_);
    attempts_.back().fit.end = FitEnd::kCancelled;
  }
  std::ranges::sort(attempts_, worse);
  const auto reached =
      std::ranges::find_if(attempts_, [&](const Attempt& a) { return a.psnr > *goal_.psnr; });
  if (reached == attempts_.end()) {
    if (!attempts_.back().cancelled()) attempts_.back().fit.end = FitEnd::kPsnrMissed;
    return storedForPsnr(std::move(attempts_.back()));
  }
  // Of two that reach it, either may be the smaller one: with fewer ellipsoids, or with more that are rounded more.
  std::optional<Conversion> smallest;
  std::uint64_t fewest = 0;
  for (auto a = reached; a != attempts_.end(); ++a) {
    if (!a->cancelled()) a->fit.end = FitEnd::kPsnrReached;
    const auto before = std::exchange(reached_, std::nullopt);
    Conversion now = storedForPsnr(std::move(*a));
    const std::uint64_t bytes = bytesOfEllipsoids(now.grid);
    // Rounding may take a fit below the PSNR.
    const bool misses = now.fit.end == FitEnd::kPsnrMissed;
    const bool missed = smallest && smallest->fit.end == FitEnd::kPsnrMissed;
    if (!smallest || (misses != missed ? missed : bytes < fewest))
      smallest = std::move(now), fewest = bytes;
    else
      reached_ = before;
  }
  return std::move(*smallest);
}

}  // namespace esvr::encode
