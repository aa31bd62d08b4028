#include "convert/size_search.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "convert/unless_cancelled.h"
#include "esvr/grid_coding.h"
#include "format/section_table.h"

namespace esvr::convert {
namespace {

// Usual values. They decide how many fits a search takes; the bytes of every grid are counted.
constexpr double kMaxUsefulLoss = 2.5;  // loss, dB, above which fewer ellipsoids are better
constexpr double kRepairFactor = 1.25;  // smallest growth of the bytes per ellipsoid by a repair
constexpr int kMaxRepairs = 3;
constexpr std::uint64_t kRefillDivisor = 100;  // a hundredth of the bytes unused: search again
constexpr double kRefitFactor = 1.25;  // growth of the bytes for ellipsoids that is worth a fit

/// Largest padding of the ellipsoids' sections, of which each chunk has one.
std::uint64_t paddingOf(const StoredGrid& grid) {
  return grid.field.chunks.size() * (format::kAlignment - 1);
}

/// Bytes that a grid adds to a file besides its ellipsoids, including padding.
std::uint64_t bytesBesides(const CompactResult& compact) {
  return bytesOfEllipsoids(compact.grid) - compact.bytes + paddingOf(compact.grid);
}

class SizeSearch {
 public:
  SizeSearch(const Job& job, std::uint64_t bytes)
      : options_(job.options), job_{job.input, options_}, bytes_(bytes) {
    draft_ = attempt(job_, kContinuedFrom * double(bytes_) / kBytesPerEllipsoid, FitLength::kShort);
    draft_ = withBetterSigns(job_.input, std::move(draft_), options_);
    bothSigns_ = draft_.bothSigns;
  }

  SizeSearch(const SizeSearch&) = delete;
  SizeSearch& operator=(const SizeSearch&) = delete;

  /// The PSNR to expect of a full fit. None follows a short fit that was cancelled.
  [[nodiscard]] double expected() const {
    return draft_.psnr + (draft_.cancelled() ? 0.0 : shortFitBehind(job_.input.source)) -
           kUsualLoss;
  }

  SizeResult run(std::optional<double> above) {
    const double expected = this->expected();
    Attempt last = std::move(draft_);
    if (above && !last.cancelled() && expected + kUncertainty < *above)
      return {std::nullopt, 0, expected};
    const CompactResult first = compactFor(last, {});
    if (!reserve(bytesBesides(first))) return refused();
    double each = priceOf(last, first) / kShortFitPrice;
    for (int repairs = 0; !last.cancelled(); ++repairs) {
      const std::uint64_t before = left_;
      auto fitted = unlessCancelled([&]() -> std::optional<Attempt> {
        const double count = double(before) / each;
        return canContinue(last, count) ? continued(job_, last, count)
                                        : attempt(job_, count, FitLength::kWhole);
      });
      if (!fitted) break;  // the fit before is the best so far
      last = std::move(*fitted);
      CompactResult now = filled(last);
      if (besides_ >= bytes_) return refused();
      const bool isLast = repairs + 1 >= kMaxRepairs;
      if (!isLast && !last.cancelled() && double(left_) > kRefitFactor * double(before)) continue;
      const bool fits = now.bytes <= left_;
      if (fits && (now.loss <= kMaxUsefulLoss || isLast))
        return {stored(std::move(last.fit), std::move(now)), 0, expected};
      if (!fits && last.asked == 1) return {std::nullopt, besides_ + now.bytes, expected};
      each = std::max(priceOf(last, compactFor(last, {})), kRepairFactor * each);
    }
    last.fit.end = FitEnd::kCancelled;
    CompactResult compact = compactFor(last, {.bytes = left_});
    if (compact.bytes > left_) throw Cancelled();  // nothing that keeps to the size is there
    return {stored(std::move(last.fit), std::move(compact)), 0, expected};
  }

 private:
  [[nodiscard]] Conversion stored(FitResult fit, CompactResult compact) const {
    Conversion conversion = conversionOf(std::move(fit), std::move(compact));
    conversion.decisions.bothSigns = bothSigns_;
    return conversion;
  }

  /// Reserves bytes for the grid's other sections. \return false if no bytes remain
  bool reserve(std::uint64_t besides) {
    besides_ = besides;
    left_ = besides < bytes_ ? bytes_ - besides : 0;
    return left_ > 0;
  }

  [[nodiscard]] SizeResult refused() const { return {std::nullopt, besides_, 0.0}; }

  /// Gives this grid and all later ones a single threshold.
  void dropLevels(Attempt& attempt) {
    options_.storage.activity = Activity::kByValue;
    attempt.grid = withOneThreshold(std::move(attempt.grid));
  }

  /// Compacts an attempt. The thresholds of its blocks are dropped if they take too much of the size.
  CompactResult compactFor(Attempt& attempt, const StorageTarget& target) {
    CompactResult now = compacted(job_, attempt, target);
    if (!levelsTakeTooMuch(now.grid, bytes_)) return now;
    dropLevels(attempt);
    return compacted(job_, attempt, target);
  }

  /// True if blocks have thresholds for which no bytes were reserved, and the ellipsoids would have to
  /// make so much room for them that these thresholds are not worth it.
  [[nodiscard]] bool levelsDisplace(const CompactResult& now) const {
    const double left = double(bytes_) - double(bytesBesides(now));
    return now.grid.topology == TopologyKind::kBlocks && kRefitFactor * left < double(left_);
  }

  /// Compacts an attempt to the bytes that remain. The other sections of a full fit's grid may be
  /// larger or smaller than the short fit's; the bytes are then reserved again.
  CompactResult filled(Attempt& attempt) {
    CompactResult now = compactFor(attempt, {.bytes = left_});
    if (levelsDisplace(now)) {
      dropLevels(attempt);
      now = compactFor(attempt, {.bytes = left_});
    }
    const std::uint64_t besides = bytesBesides(now), padding = paddingOf(now.grid);
    const bool larger = besides > besides_ + padding;
    const bool muchSmaller = besides_ > besides + padding + bytes_ / kRefillDivisor;
    if ((larger || muchSmaller) && reserve(besides)) now = compactFor(attempt, {.bytes = left_});
    return now;
  }

  ConvertOptions options_;
  Job job_;
  std::uint64_t bytes_, besides_ = 0, left_ = 0;
  Attempt draft_;  ///< a short fit
  Decision bothSigns_;
};

}  // namespace

SizeResult searchSize(const Job& job, std::uint64_t bytes, std::optional<double> above) {
  return SizeSearch(job, bytes).run(above);
}

StartedSizeSearch startSizeSearch(const Job& job, std::uint64_t bytes) {
  const auto search = std::make_shared<SizeSearch>(job, bytes);
  return {search->expected(), [search](std::optional<double> above) { return search->run(above); }};
}

}  // namespace esvr::convert
