#include "convert/psnr_search.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "convert/psnr_slope.h"
#include "convert/unless_cancelled.h"

namespace esvr::convert {
namespace {

// Usual values. They decide how many fits a search takes; the PSNR of every fit is measured.
constexpr double kVoxelsPerEllipsoid = 35.0;  // active voxels per ellipsoid of the first guess
constexpr double kMaxGrowth = 8.0;            // largest factor of the number between two fits
constexpr double kNear = 1.3;  // factor of the number up to which a short fit is extrapolated
constexpr double kSteepestDbPerDoubling = 7.0;  // short fits of aneurism gain 6.7 dB
constexpr std::size_t kMaxFits = 4;             // the search continues if none reached the PSNR
// Smallest growth of the number of such a further fit. A PSNR that is missed, by however little, asks
// for more; with less, the fits would tend to a number and never end.
constexpr double kMinGrowth = 1.01;

/// dB by which the float32 grid should exceed the PSNR: the best value, and the limits within which
/// the size hardly differs.
struct Margin {
  double aim, min, max;
};
constexpr Margin kCompactMargin{kUsualLoss, 0.35, 2.0};
constexpr Margin kFloat32Margin{0.3, 0.0, 0.9};

class PsnrSearch {
 public:
  PsnrSearch(const Job& job, double psnr)
      : options_(job.options),
        job_{job.input, options_},
        psnr_(psnr),
        compact_(job.options.storage.form == Storage::kCompact),
        margin_(compact_ ? kCompactMargin : kFloat32Margin),
        behind_(shortFitBehind(job.input.source)),
        maxCount_(job.options.fit.count.value_or(activeVoxelCount(job.input.source))) {}

  void stayBelow(std::uint64_t bytes) {
    below_ = bytes;
    maxCount_ = std::min(maxCount_, std::uint64_t(double(bytes) / kMinBytesPerEllipsoid) + 1);
  }

  void makeDraft() { draft_ = nearDraft(); }
  void makeDraft(const CancelToken& cancel) {
    const CancelToken* own = std::exchange(options_.fit.cancel, &cancel);
    makeDraft();
    options_.fit.cancel = own;
  }

  PsnrResult run() {
    Attempt& draft = *draft_;
    bothSigns_ = draft.bothSigns;
    std::uint64_t expected = 0;
    if (below_ && !draft.cancelled()) {
      const CompactResult compact = compacted(job_, draft, {});
      const double price = priceOf(draft, compact) / kShortFitPrice;
      const double besides = double(bytesOfEllipsoids(compact.grid) - compact.bytes);
      expected = std::uint64_t(besides + price * neededCount(draft, aim() - behind_));
      if (besides + price * neededCount(draft, aim() - behind_ - kUncertainty) > double(*below_))
        return {std::nullopt, expected};
    }
    if (!draft.cancelled()) fitUntilReached(scaledCount(draft, aim() - behind_));
    if (attempts_.empty()) return {stored(cancelled(std::move(draft))), expected};
    return {anyReached() ? smallest() : best(), expected};
  }

 private:
  [[nodiscard]] double firstCount() const {
    double guess = double(activeVoxelCount(job_.input.source)) / kVoxelsPerEllipsoid;
    if (below_) guess = std::min(guess, double(*below_) / kBytesPerEllipsoid);
    return capped(guess);
  }

  /// The attempt with the most ellipsoids from which a fit can continue; null if there is none.
  [[nodiscard]] const Attempt* startFor(double count) const {
    const Attempt* start = nullptr;
    const auto distance = [&](const Attempt& a) {
      return std::abs(std::log(pointOf(a).count / count));
    };
    const auto consider = [&](const Attempt& a) {
      if (canContinue(a, count) && (!start || distance(a) <= distance(*start))) start = &a;
    };
    if (draft_) consider(*draft_);
    for (const Attempt& a : attempts_) consider(a);
    return start;
  }

  [[nodiscard]] Attempt next(double count) const {
    const Attempt* start = startFor(count);
    return start ? continued(job_, *start, count) : attempt(job_, count, FitLength::kWhole);
  }

  [[nodiscard]] static Attempt cancelled(Attempt attempt) {
    attempt.fit.end = FitEnd::kCancelled;
    return attempt;
  }

  void markCancelled() {
    for (Attempt& a : attempts_) a.fit.end = FitEnd::kCancelled;
  }

  /// True if ellipsoids may reach the PSNR within the bytes, by an extrapolation that favours them.
  [[nodiscard]] bool canReach(const Attempt& draft) const {
    const double psnr = aim() - behind_ - kUncertainty;
    const double count = countFor(pointOf(draft), psnr, kSteepestDbPerDoubling);
    if (below_ && kBytesPerEllipsoid * count > double(*below_)) return false;
    return count <= double(maxCount_);
  }

  /// A short fit whose number of ellipsoids is near the one that the PSNR needs, with the better
  /// signs. The first guess can be far from it, where signs and prices differ.
  [[nodiscard]] Attempt nearDraft() {
    Attempt draft = attempt(job_, firstCount(), FitLength::kShort);
    const double count = capped(kContinuedFrom * scaledCount(draft, aim() - behind_));
    const double ratio = count / pointOf(draft).count;
    const bool isFar = std::max(ratio, 1.0 / ratio) > kNear;
    if (!draft.cancelled() && !canReach(draft)) return draft;
    if (!draft.cancelled() && isFar) {
      auto nearer = unlessCancelled(
          [&]() -> std::optional<Attempt> { return attempt(job_, count, FitLength::kShort); });
      if (!nearer) return cancelled(std::move(draft));
      slope_ = dbPerDoubling(pointOf(draft), pointOf(*nearer));
      draft = std::move(*nearer);
    }
    return withBetterSigns(job_.input, std::move(draft), options_);
  }

  void fitUntilReached(double count) {
    do {
      auto found = unlessCancelled([&]() -> std::optional<Attempt> { return next(capped(count)); });
      if (!found) return markCancelled();
      attempts_.push_back(std::move(*found));
      if (attempts_.back().cancelled() || goodEnough(attempts_.back())) break;
      count = nextCount();
    } while (mayImprove(count));
  }

  /// True if a fit of this number of ellipsoids may be better than those before it. A fit of a number
  /// that was asked for is the same again, and further fits are made only as long as they grow.
  [[nodiscard]] bool mayImprove(double count) const {
    const auto wanted = std::size_t(std::max(std::floor(capped(count)), 1.0));
    std::size_t most = 0;
    for (const Attempt& a : attempts_) {
      if (a.asked == wanted) return false;
      most = std::max(most, a.asked);
    }
    if (attempts_.size() < kMaxFits) return true;
    return !anyReached() && double(wanted) >= kMinGrowth * double(most);
  }

  [[nodiscard]] double aim() const { return psnr_ + margin_.aim; }
  [[nodiscard]] double capped(double count) const { return std::min(count, double(maxCount_)); }
  [[nodiscard]] bool reached(const Attempt& a) const { return a.psnr > psnr_; }
  [[nodiscard]] bool anyReached() const {
    return std::any_of(attempts_.begin(), attempts_.end(),
                       [&](const Attempt& a) { return reached(a); });
  }

  [[nodiscard]] bool nearAim(const Attempt& a) const {
    const double over = a.psnr - psnr_;
    return over >= margin_.min && over <= margin_.max;
  }

  [[nodiscard]] bool goodEnough(const Attempt& a) const {
    const bool allThereIs =
        a.fit.deviceFull ||  // the device holds no more ellipsoids
        a.asked >= std::min<std::uint64_t>(maxCount_, activeVoxelCount(job_.input.source));
    return nearAim(a) || (a.psnr < psnr_ + margin_.min && allThereIs);
  }

  [[nodiscard]] static CountPoint pointOf(const Attempt& a) {
    return {double(std::max<std::size_t>(a.count(), 1)), a.psnr};
  }

  /// The number of ellipsoids that should reach a PSNR, extrapolated from an attempt.
  [[nodiscard]] double neededCount(const Attempt& from, double psnr) const {
    return countFor(pointOf(from), psnr, slope_);
  }

  /// The number of ellipsoids of the next fit: neededCount(), but not too far from the attempt's.
  [[nodiscard]] double scaledCount(const Attempt& from, double psnr) const {
    const double count = pointOf(from).count;
    return std::clamp(neededCount(from, psnr), count / kMaxGrowth, count * kMaxGrowth);
  }

  /// The attempt nearest to the aim, on the given side of it; null if there is none.
  [[nodiscard]] const Attempt* nearest(bool above) const {
    const Attempt* found = nullptr;
    for (const Attempt& a : attempts_)
      if ((a.psnr >= aim()) == above && (!found || (a.psnr < found->psnr) == above)) found = &a;
    return found;
  }

  /// The next number of ellipsoids: interpolated between the nearest attempts on both sides of the
  /// aim, otherwise extrapolated from the last attempt.
  [[nodiscard]] double nextCount() const {
    const Attempt *below = nearest(false), *above = nearest(true);
    if (!below || !above) return scaledCount(attempts_.back(), aim());
    const double share = (aim() - below->psnr) / (above->psnr - below->psnr);
    return double(below->count()) *
           std::pow(double(above->count()) / double(below->count()), share);
  }

  /// True for attempts that may be the smallest: those near the aim, or, if there are none, the one
  /// whose PSNR exceeds the goal by the smallest amount.
  [[nodiscard]] bool candidate(const Attempt& a) const {
    if (!reached(a)) return false;
    const auto isNearAim = [&](const Attempt& other) { return nearAim(other); };
    if (std::any_of(attempts_.begin(), attempts_.end(), isNearAim)) return nearAim(a);
    return std::none_of(attempts_.begin(), attempts_.end(), [&](const Attempt& other) {
      return reached(other) && other.psnr < a.psnr;
    });
  }

  [[nodiscard]] Conversion packed(Attempt attempt) const {
    if (!compact_) return conversionOf(std::move(attempt));
    CompactResult compact = compacted(job_, attempt, {.psnr = psnr_});
    return conversionOf(std::move(attempt.fit), std::move(compact));
  }

  [[nodiscard]] Conversion stored(Attempt attempt) const {
    Conversion conversion = packed(std::move(attempt));
    conversion.decisions.bothSigns = bothSigns_;
    return conversion;
  }

  [[nodiscard]] Conversion marked(Attempt attempt, FitEnd end) const {
    if (!attempt.cancelled()) attempt.fit.end = end;
    return stored(std::move(attempt));
  }

  [[nodiscard]] Conversion smallest() {
    std::optional<Conversion> smallest;
    std::uint64_t fewest = 0;
    std::vector<bool> candidates;
    for (const Attempt& a : attempts_) candidates.push_back(candidate(a));
    for (std::size_t i = 0; i < attempts_.size(); ++i) {
      if (!candidates[i]) continue;
      Conversion now = marked(std::move(attempts_[i]), FitEnd::kPsnrReached);
      const std::uint64_t bytes = bytesOfEllipsoids(now.grid);
      if (smallest && bytes >= fewest) continue;
      smallest = std::move(now);
      fewest = bytes;
    }
    return std::move(*smallest);
  }

  [[nodiscard]] Conversion best() {
    const auto worse = [](const Attempt& a, const Attempt& b) { return a.psnr < b.psnr; };
    return marked(std::move(*std::max_element(attempts_.begin(), attempts_.end(), worse)),
                  FitEnd::kPsnrMissed);
  }

  ConvertOptions options_;
  Job job_;
  double psnr_;
  std::optional<std::uint64_t> below_;
  bool compact_;
  Margin margin_;
  double behind_;  ///< PSNR of a full fit less that of a short fit, dB
  std::uint64_t maxCount_;
  double slope_ = kDbPerDoubling;
  Decision bothSigns_;
  std::optional<Attempt> draft_;
  std::vector<Attempt> attempts_;
};

}  // namespace

PsnrResult searchPsnr(const Job& job, double psnr, std::optional<std::uint64_t> below) {
  PsnrSearch search(job, psnr);
  if (below) search.stayBelow(*below);
  search.makeDraft();
  return search.run();
}

RestOfSearch startPsnrSearch(const Job& job, double psnr, const CancelToken& cancel) {
  const auto search = std::make_shared<PsnrSearch>(job, psnr);
  search->makeDraft(cancel);
  return [search](std::optional<std::uint64_t> below) {
    if (below) search->stayBelow(*below);
    return search->run();
  };
}

}  // namespace esvr::convert
