#include "esvr/rate_control.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"
#include "format/layout.h"

namespace esvr {
namespace {

/// Quantising may cost so much where bytes are short: the same bytes do as much in more ellipsoids
/// as in more bits (docs/benchmarks.md has the measurement).
constexpr double kLoss = 0.9;                      // dB
constexpr double kMinLoss = 0.35, kMaxLoss = 2.0;  // near enough: the optimum is flat
constexpr double kBytesPerEllipsoid = 8.0;         // first guess
constexpr double kDbPerDoubling = 4.5;             // of the number of ellipsoids
constexpr double kDraftBehind = 2.5;               // dB that a short fit stays behind a full one
constexpr double kDraftCheaper = 0.94;             // than a full fit's ellipsoids at the same loss
constexpr double kVoxelsPerEllipsoid = 35.0;       // first guess of a PSNR run
constexpr double kTooMuchLoss = 2.5;               // dB: fewer ellipsoids would be better
constexpr double kFewer = 1.25;                    // bytes each, from repair to repair at least
constexpr int kMaxRepairs = 3;
constexpr double kMaxGrowth = 8.0;
constexpr std::uint32_t kDraftShare = 4;  // of the iterations
constexpr std::size_t kMaxFits = 3;       // and more until one reaches the PSNR
constexpr std::uint64_t kNoticed = 100;   // a hundredth of the size is worth another search

struct Attempt {
  FitResult fit;
  StoredGrid grid;  ///< float32
  double psnr = 0.0;
  std::size_t asked = 0;  ///< ellipsoids
};

class RateControl {
 public:
  explicit RateControl(const RateInput& input)
      : input_(input), voxels_(activeVoxelCount(input.source)) {}

  RatedGrid toSize(std::uint64_t bytes) {
    Attempt last = attempt(double(bytes) / kBytesPerEllipsoid, true);
    Price price = priceOf(last);
    if (price.own >= bytes) refuse(price.own, bytes);
    std::uint64_t left = bytes - price.own;
    double each = price.each / kDraftCheaper;
    for (int n = 0; !ended(last); ++n) {
      last = attempt(double(left) / each, false);
      RatedGrid now = rated(last, left);
      // the full fit's grid may store other sections than the short one's
      const std::uint64_t own = bytesBesides(now.grid, now.compact.bytes);
      if (own > price.own + paddingOf(now.grid) ||
          price.own > own + paddingOf(now.grid) + bytes / kNoticed) {
        if (own >= bytes) refuse(own, bytes);
        price.own = own;
        left = bytes - own;
        now = rated(last, left);
      }
      const bool fits = now.compact.bytes <= left;
      if (fits && (now.compact.loss <= kTooMuchLoss || n + 1 >= kMaxRepairs)) return now;
      if (!fits && last.asked == 1) refuse(price.own + now.compact.bytes, bytes);
      // the short fit promised too much: price the full one's ellipsoids, and fewer each time
      each = std::max(priceOf(last).each, kFewer * each);
    }
    return rated(last, left);
  }

  RatedGrid toPsnr(double psnr) {
    const Attempt draft = attempt(double(voxels_) / kVoxelsPerEllipsoid, true);
    std::vector<Attempt> attempts;
    double count = scaledCount(draft, psnr + kLoss - kDraftBehind);
    do {
      attempts.push_back(attempt(count, false));
      if (goodEnough(attempts.back(), psnr) || ended(attempts.back())) break;
      count = nextCount(attempts, psnr + kLoss);
    } while (attempts.size() < kMaxFits || !reached(attempts, psnr));
    return smallest(std::move(attempts), psnr);
  }

 private:
  /// Of an attempt's ellipsoids at the usual loss.
  struct Price {
    double each = 0.0;
    std::uint64_t own = 0;  ///< what the grid adds to a file besides
  };
  [[nodiscard]] Price priceOf(const Attempt& attempt) const {
    const auto compact = compactGrid(attempt.grid, input_.source, compactOptions(kLoss));
    const double count = double(std::max<std::size_t>(countOf(attempt), 1));
    return {std::max(double(compact.bytes) / count, 1.0),
            bytesBesides(compact.grid, compact.bytes)};
  }

  [[noreturn]] void refuse(std::uint64_t least, std::uint64_t bytes) const {
    throw UsageError("grid '" + input_.descriptor.name + "' takes " + std::to_string(least) +
                     " bytes at least; there are " + std::to_string(bytes));
  }

  [[nodiscard]] bool goodEnough(const Attempt& attempt, double psnr) const {
    const double over = attempt.psnr - psnr;
    const bool allThereIs = attempt.asked >= voxels_;
    return leavesUsualLoss(over) || (over < 0.0 && allThereIs);
  }

  static bool reached(const std::vector<Attempt>& attempts, double psnr) {
    return std::any_of(attempts.begin(), attempts.end(),
                       [&](const Attempt& attempt) { return attempt.psnr > psnr; });
  }

  static bool leavesUsualLoss(double over) { return over >= kMinLoss && over <= kMaxLoss; }

  /// Of those that reached a PSNR: where some leave the usual loss only these, else the nearest.
  static bool worthRating(const Attempt& attempt, const std::vector<Attempt>& all, double psnr) {
    double nearest = HUGE_VAL;
    bool anyUsual = false;
    for (const Attempt& a : all) {
      if (a.psnr > psnr) nearest = std::min(nearest, a.psnr);
      anyUsual = anyUsual || leavesUsualLoss(a.psnr - psnr);
    }
    return anyUsual ? leavesUsualLoss(attempt.psnr - psnr) : attempt.psnr == nearest;
  }

  /// From the last attempt, or between the nearest on either side.
  [[nodiscard]] double nextCount(const std::vector<Attempt>& attempts, double psnr) const {
    const Attempt* below = nullptr;
    const Attempt* above = nullptr;
    for (const Attempt& attempt : attempts) {
      if (attempt.psnr < psnr && (!below || attempt.psnr > below->psnr)) below = &attempt;
      if (attempt.psnr >= psnr && (!above || attempt.psnr < above->psnr)) above = &attempt;
    }
    if (!below || !above) return scaledCount(attempts.back(), psnr);
    const double share = (psnr - below->psnr) / (above->psnr - below->psnr);
    return double(countOf(*below)) *
           std::pow(double(countOf(*above)) / double(countOf(*below)), share);
  }

  RatedGrid smallest(std::vector<Attempt> attempts, double psnr) {
    CompactOptions options = compactOptions(kLoss);
    options.psnr = psnr;
    const auto worse = [](const Attempt& a, const Attempt& b) { return a.psnr < b.psnr; };
    if (!reached(attempts, psnr)) {
      Attempt& best = *std::max_element(attempts.begin(), attempts.end(), worse);
      if (!ended(best)) best.fit.end = FitEnd::kPsnrMissed;
      return rated(std::move(best), options);
    }
    std::optional<RatedGrid> smallest;
    for (Attempt& attempt : attempts) {
      if (!worthRating(attempt, attempts, psnr)) continue;
      if (!ended(attempt)) attempt.fit.end = FitEnd::kPsnrReached;
      RatedGrid now = rated(std::move(attempt), options);
      if (!smallest || now.compact.bytes < smallest->compact.bytes) smallest = std::move(now);
    }
    return std::move(*smallest);
  }

  static bool ended(const Attempt& attempt) { return attempt.fit.end == FitEnd::kCancelled; }
  static std::size_t countOf(const Attempt& attempt) { return attempt.grid.field.ellipsoidCount(); }

  /// How many ellipsoids should reach a PSNR, from what an attempt reached.
  [[nodiscard]] double scaledCount(const Attempt& from, double psnr) const {
    const double factor = std::exp2((psnr - from.psnr) / kDbPerDoubling);
    return double(std::max<std::size_t>(countOf(from), 1)) *
           std::clamp(factor, 1.0 / kMaxGrowth, kMaxGrowth);
  }

  [[nodiscard]] CompactOptions compactOptions(double loss) const {
    CompactOptions options;
    options.loss = loss;
    options.box = input_.options.box;
    options.device = input_.options.device;
    return options;
  }

  Attempt attempt(double count, bool draft) {
    FitOptions options = input_.options;
    options.count = std::size_t(std::clamp(std::floor(count), 1.0, double(voxels_)));
    options.psnr.reset();
    if (draft && options.iterations)
      options.iterations = std::max(*options.iterations / kDraftShare, 1u);
    else if (draft)
      options.preset = Preset::kDraft;
    Attempt result;
    result.asked = *options.count;
    result.fit = fit(input_.source, options);
    result.grid = makeStoredGrid(input_.descriptor, input_.source, std::move(result.fit.field),
                                 input_.activity);
    result.psnr = compareVolumes(input_.source, decodeGrid(result.grid),
                                 {.box = input_.options.box, .peak = {}, .ssim = false})
                      .psnrBox;
    return result;
  }

  /// What a grid adds to a file but for its ellipsoids' section.
  static std::uint64_t bytesBesides(const StoredGrid& grid, std::uint64_t ellipsoids) {
    EsvrFile with, without;
    with.grids.push_back(grid);
    // sections begin at multiples of 8
    return encodeEsvr(with).size() - encodeEsvr(without).size() - ellipsoids + paddingOf(grid);
  }
  static std::uint64_t paddingOf(const StoredGrid& grid) {
    return grid.field.chunks.size() * (format::kAlignment - 1);
  }

  RatedGrid rated(const Attempt& attempt, std::uint64_t bytes) {
    CompactOptions options = compactOptions(kLoss);
    options.bytes = bytes;
    return rated(attempt, options);
  }

  RatedGrid rated(Attempt attempt, const CompactOptions& options) {
    RatedGrid result;
    result.compact = compactGrid(attempt.grid, input_.source, options);
    result.grid = std::move(result.compact.grid);
    result.fit = std::move(attempt.fit);
    return result;
  }

  const RateInput& input_;
  std::uint64_t voxels_;
};

}  // namespace

RatedGrid fitToSize(const RateInput& input, std::uint64_t bytes) {
  return RateControl(input).toSize(bytes);
}

RatedGrid fitToPsnr(const RateInput& input, double psnr) { return RateControl(input).toPsnr(psnr); }

}  // namespace esvr
