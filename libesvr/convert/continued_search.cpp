#include "convert/continued_search.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "compact/continued_maker.h"
#include "convert/motion_estimate.h"
#include "convert/psnr_slope.h"
#include "core/axes.h"
#include "esvr/error.h"
#include "esvr/frame_coding.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"

namespace esvr::convert {
namespace {

// docs/lab-notes.md, "Ellipsoids of a sequence", has what was tried instead.
/// Iterations of a fit. They are few, since it begins with ellipsoids that fit almost.
constexpr std::uint32_t kContinuedIterations = 120;
/// dB by which the float32 grid should exceed the PSNR: the best value, and the limits within which
/// nothing is changed.
constexpr double kAimOver = 1.5, kMinOver = 1.0, kMaxOver = 4.0;
/// dB by which all of these increase if the rounded ellipsoids do not reach the PSNR.
constexpr double kFurther = 0.6;
constexpr int kMaxContinuedFits = 5;
/// Largest growth of the number of ellipsoids in a frame; with more, a fit from seeds is better.
constexpr double kMaxContinuedGrowth = 1.5;

/// Prices of a bit, in squares of a quantisation step: the largest one, the first that is tried, the
/// least one that is worth a trial, and the share by which two prices may differ at the end.
constexpr double kMaxPrice = 2.0, kFirstPrice = 0.2, kLeastPrice = 0.02, kPriceBracket = 0.25;
/// dB that a trial without a price must leave to the PSNR.
constexpr double kRoom = 0.25;
/// dB by which the PSNR of a trial must exceed the wanted one: a reader's sums have another order.
constexpr double kReaderMargin = 5e-4;

Field withoutWeakest(const Field& field, std::size_t count, std::vector<std::uint32_t>& kept) {
  const Ellipsoids& e = field.chunks[0].ellipsoids;
  std::vector<double> weight(e.size());
  for (std::size_t i = 0; i < e.size(); ++i)
    weight[i] = std::log(std::max(std::abs(double(e.intensity[i])), 1e-300)) +
                0.5 * (double(e.logScale[0][i]) + e.logScale[1][i] + e.logScale[2][i]);
  kept.resize(e.size());
  std::iota(kept.begin(), kept.end(), 0u);
  std::ranges::stable_sort(kept, std::ranges::greater(), [&](auto i) { return weight[i]; });
  kept.resize(count);
  std::ranges::sort(kept);
  Field result = field;
  Ellipsoids& some = result.chunks[0].ellipsoids;
  some.resize(count);
  for (std::size_t k = 0; k < count; ++k) {
    for (std::size_t a = 0; a < 3; ++a) {
      some.center[a][k] = e.center[a][kept[k]];
      some.logScale[a][k] = e.logScale[a][kept[k]];
    }
    for (std::size_t a = 0; a < 4; ++a) some.rotation[a][k] = e.rotation[a][kept[k]];
    some.intensity[k] = e.intensity[kept[k]];
  }
  return result;
}

class ContinuedSearch {
 public:
  ContinuedSearch(const Job& job, double psnr)
      : job_(job), psnr_(psnr), previous_(*job.options.previous), field_(startField()) {
    from_.resize(field_.ellipsoidCount());
    std::iota(from_.begin(), from_.end(), 0u);
  }

  std::optional<Conversion> run() {
    for (int n = 0; n < kMaxContinuedFits; ++n) {
      fitOnce();
      if (fit_.end == FitEnd::kCancelled || !isInOneChunk()) return std::nullopt;
      const bool isLast = n + 1 == kMaxContinuedFits;
      if (!isNear() && !isLast && mayChange()) continue;
      if (over() > 0.0)
        if (auto found = quantised()) return found;
      margin_ += kFurther;
      if (!mayChange()) break;
    }
    return std::nullopt;
  }

 private:
  /// The ellipsoids of the previous frame, moved if that makes them more like the frame.
  [[nodiscard]] Field startField() const {
    const SparseVolume before = decodeGrid(previous_, {.memory = memoryOf(job_.input.source)});
    StoredGrid start = previous_;
    start.field = moved(previous_.field, estimateMotion(before, job_.input.source));
    start.quantised.clear();
    return psnrOf(job_, start) > psnrOf(job_, before) ? start.field : previous_.field;
  }

  void fitOnce() {
    FitOptions options = job_.options.fit;
    options.count = std::max(wanted_, field_.ellipsoidCount());
    options.iterations = std::min(plannedIterations(options), kContinuedIterations);
    options.start = &field_;
    options.keepsStart = true;
    options.kappa = previous_.field.kernel.kappa;
    options.bothSigns = previous_.quantised[0].lattice.signedIntensity;
    options.psnr.reset();
    options.seconds.reset();
    FitResult result = fit(job_.input.source, options);
    std::vector<std::uint32_t> from;
    for (const std::uint32_t i : result.startOf) from.push_back(i == kNoStart ? i : from_[i]);
    from_ = std::move(from);
    field_ = std::move(result.field);
    fit_ = std::move(result);
  }

  /// False after a fit in chunks too.
  [[nodiscard]] bool isInOneChunk() const {
    return field_.chunks.size() == 1 && from_.size() == field_.ellipsoidCount();
  }

  /// dB of the sum over the PSNR, as the device of the fit measures it.
  [[nodiscard]] double over() const { return fit_.curve.back().psnrBox - psnr_; }
  [[nodiscard]] bool isNear() const {
    return over() >= kMinOver + margin_ && over() <= kMaxOver + margin_;
  }

  /// Chooses the number of ellipsoids of the next fit. \return false if none promises to do
  [[nodiscard]] bool mayChange() {
    const auto count = double(field_.ellipsoidCount());
    const double next = countFor({count, over()}, kAimOver + margin_, kDbPerDoubling);
    if (over() > kMaxOver + margin_) {
      wanted_ = std::size_t(std::max(next, count / kMaxContinuedGrowth));
      if (wanted_ >= field_.ellipsoidCount()) return false;
      std::vector<std::uint32_t> kept;
      field_ = withoutWeakest(field_, wanted_, kept);
      std::vector<std::uint32_t> from;
      for (const std::uint32_t i : kept) from.push_back(from_[i]);
      from_ = std::move(from);
      return true;
    }
    const auto most = std::min(kMaxContinuedGrowth * double(previous_.field.ellipsoidCount()),
                               double(maxCount()));
    if (count >= most) return false;
    wanted_ = std::size_t(std::ceil(std::clamp(next, count + 1.0, most)));
    return true;
  }

  [[nodiscard]] std::uint64_t maxCount() const {
    const std::uint64_t voxels = activeVoxelCount(job_.input.source);
    return std::min<std::uint64_t>(job_.options.fit.count.value_or(voxels), voxels);
  }

  [[nodiscard]] Box box() const {
    return job_.options.fit.box.value_or(activeBox(job_.input.source));
  }

  /// The sum of squares over the box at a PSNR.
  [[nodiscard]] double squaresAt(double psnr) const {
    const double peak = job_.options.fit.peak.value_or(peakOf(job_.input.source));
    return peak * peak * box().volume() * std::pow(10.0, -psnr / 10.0);
  }

  [[nodiscard]] std::optional<Conversion> quantised() {
    StoredGrid grid =
        makeStoredGrid(job_.input.descriptor, job_.input.source, field_, activityOf(job_));
    auto trial = rounded(grid);
    if (!trial) return std::nullopt;
    grid.field = std::move(trial->field);
    grid.quantised = std::move(trial->quantised);
    renewActivity(job_.input.source, activityOf(job_), grid);
    if (psnrOf(job_, grid) < psnr_ || bytesInFrame(grid, &previous_) >= bytesAdded(grid))
      return std::nullopt;
    Conversion conversion;
    conversion.grid = std::move(grid);
    conversion.compact = CompactRecord{over(), {}};
    conversion.fit = std::move(fit_);
    conversion.fit.end = FitEnd::kPsnrReached;
    return conversion;
  }

  /// \return nothing if the PSNR is not reached, or a value lies outside the lattice of the previous
  ///         frame
  [[nodiscard]] std::optional<Trial> rounded(const StoredGrid& grid) const try {
    const StoredGrid tried = withOneThreshold(grid);
    ContinuedMaker maker({tried, from_, previous_},
                         {.source = job_.input.source,
                          .box = box(),
                          .device = rateControlDevice(fit_, job_.options.fit.device),
                          .peak = job_.options.fit.peak});
    return maker.anyContinues() ? cheapest(grid, maker) : std::nullopt;
  } catch (const RuntimeFailure&) {
    return std::nullopt;
  }

  /// Squared error of the grid that a reader gets from a trial, relative to that of its sum. A mask
  /// or the thresholds of blocks remove errors outside of it.
  [[nodiscard]] double shareOfError(const StoredGrid& grid, const Trial& trial) const {
    if (grid.topology == TopologyKind::kThreshold || !(trial.error > 0.0)) return 1.0;
    StoredGrid decoded = grid;
    decoded.field = trial.field;
    decoded.quantised.clear();
    return squaresAt(psnrOf(job_, decoded)) / trial.error;
  }

  /// The trial with the highest price that reaches the PSNR; nothing if none does. The steps are
  /// refined where those of the previous frame leave no room for a price.
  [[nodiscard]] std::optional<Trial> cheapest(const StoredGrid& grid, ContinuedMaker& maker) const {
    Trial first = maker.make(0.0);
    const double allowed = squaresAt(psnr_ + kReaderMargin) / shareOfError(grid, first);
    if (first.error > allowed * std::pow(10.0, -kRoom / 10.0)) {
      maker.refine(1);
      first = maker.make(0.0);
    }
    if (first.error > allowed) return std::nullopt;
    return withHighestPrice(maker, allowed, std::move(first));
  }

  /// \param best  a trial without a price, which has at most the allowed error
  [[nodiscard]] static Trial withHighestPrice(ContinuedMaker& maker, double allowed, Trial best) {
    double low = 0.0, high = kMaxPrice;
    for (double price = kFirstPrice; high - low > kPriceBracket * high && high > kLeastPrice;
         price = low > 0.0 ? std::sqrt(low * high) : 0.25 * high) {
      Trial trial = maker.make(price);
      const bool reached = trial.error <= allowed;
      (reached ? low : high) = price;
      if (reached) best = std::move(trial);
    }
    return best;
  }

  const Job& job_;
  double psnr_;
  const StoredGrid& previous_;
  Field field_;                      ///< the ellipsoids so far
  std::vector<std::uint32_t> from_;  ///< those of the previous frame that they continue
  std::size_t wanted_ = 0;           ///< number of ellipsoids of the next fit
  double margin_ = 0.0;              ///< dB that are added to kAimOver, kMinOver and kMaxOver
  FitResult fit_;                    ///< the last fit
};

/// True if all places of a box have their full precision relative to the origin of a chunk.
bool isNearOrigin(Coord origin, const Box& box) {
  if (box.empty()) return false;
  for (const auto axis : kAxes) {
    const std::int64_t low = std::int64_t(box.min.*axis) - origin.*axis;
    const std::int64_t high = std::int64_t(box.max.*axis) - origin.*axis;
    if (low <= -kChunkExtent || high >= kChunkExtent) return false;
  }
  return true;
}

}  // namespace

bool mayContinue(const Job& job) {
  const StoredGrid* previous = job.options.previous;
  return previous && previous->quantised.size() == 1 && previous->quantised[0].size() > 0 &&
         !previous->residual && !previous->voxels && previous->field.fitFor == FitFor::kVoxels &&
         job.options.fit.fitFor == FitFor::kVoxels && !job.options.fit.narrowBand &&
         !job.options.fit.kappa && job.options.storage.form == Storage::kCompact &&
         job.options.representation != Representation::kVoxels &&
         isNearOrigin(previous->field.chunks[0].origin, activeBox(job.input.source));
}

std::optional<Conversion> continueTo(const Job& job, double psnr) {
  return ContinuedSearch(job, psnr).run();
}

}  // namespace esvr::convert
