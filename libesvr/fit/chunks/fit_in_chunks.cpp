#include "fit/chunks/fit_in_chunks.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <memory>
#include <numeric>
#include <utility>
#include <vector>

#include "esvr/error.h"
#include "fit/chunks/chunk_target.h"
#include "fit/chunks/divide_count.h"
#include "fit/ellipsoid_math.h"
#include "fit/export_field.h"
#include "fit/fit_plan.h"
#include "fit/import_field.h"
#include "fit/recorder.h"
#include "fit/run.h"

namespace esvr {
namespace {

/// Rounds of the fit. In each, all chunks are fitted for a part of the iterations.
constexpr int kRounds = 4;

/// The fit of one chunk so far. During a round, ellipsoids may move out of its box.
struct ChunkState {
  FitState fit;
  std::size_t firstCount = 0;  ///< ellipsoids at the start of growth
  std::size_t count = 0;       ///< ellipsoids at the end of growth
  FitErrors errors;            ///< errors of its part of the box when it was last fitted
  std::uint64_t pairs = 0;     ///< pairs of its ellipsoids and bricks
  bool begun = false;          ///< whether the chunk was fitted, or had ellipsoids at the start

  [[nodiscard]] const std::vector<Ellipsoid>& ellipsoids() const { return fit.ellipsoids; }
};

/// What the fits of the chunks add up to.
struct Totals {
  FitEnd end = FitEnd::kScheduleDone;
  std::uint32_t iterations = 0;
  std::size_t deviceBytes = 0;
  bool deviceFull = false;
  double secondsSeed = 0.0;
  double fraction = 0.0;  ///< share of the fit that is done
};

/// The brick that contains the center.
Coord brickWith(const Ellipsoid& p) {
  const auto brick = [](double v) { return std::int32_t(std::floor(v / kBrickSide)); };
  return {brick(p.center[0]), brick(p.center[1]), brick(p.center[2])};
}

int bricksIn(double voxels) { return int(std::ceil(voxels / kBrickSide)); }

/// A number of bricks beyond which a support does not reach from its center's brick.
int reachOf(const Ellipsoid& p, double radius) {
  return bricksIn(radius * std::sqrt(ellipsoid_math::norm2(inverse(p.L))));
}

bool isZero(const FitTarget& target) {
  return std::all_of(target.values.begin(), target.values.end(), [](float v) { return v == 0.0f; });
}

class ChunkedFit {
 public:
  ChunkedFit(const SparseVolume& volume, const FitOptions& options, const TargetScale& scale,
             std::span<const BrickChunk> chunks)
      : volume_(volume),
        options_(options),
        chunks_(chunks),
        activeVoxels_(activeVoxelCount(volume)),
        scene_{volume, scale, boxOf(volume, options.box),
               haloBricks(activeVoxels_, plannedCount(options, activeVoxels_))},
        states_(chunks.size()) {
    kernel_.kappa = firstKappa(options, tuning_);
    for (std::size_t c = 0; c < chunks.size(); ++c)
      states_[c].errors.squaredSumActive = energyOf(chunks[c]);
    if (options.start) takeStart();
  }

  FitResult run() {
    const auto groups = groupsOf();
    for (int n = 0; n < kRounds && !isCancelled(); ++n) {
      divideCount();
      for (const auto& group : groups) fitGroup(group, n);
      reassign();
    }
    return result();
  }

 private:
  [[nodiscard]] double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }
  [[nodiscard]] bool isCancelled() const { return totals_.end == FitEnd::kCancelled; }

  /// The groups of chunks. The first chunk is fitted before all others if it has to find kappa.
  [[nodiscard]] std::vector<std::vector<std::size_t>> groupsOf() const {
    auto groups = groupChunks(chunks_, 2 * scene_.halo);
    if (options_.kappa || groups.front().size() == 1) return groups;
    auto& first = groups.front();
    const std::vector<std::size_t> alone{first.front()};
    first.erase(first.begin());
    groups.insert(groups.begin(), alone);
    return groups;
  }

  /// Number of the chunk whose box contains a brick.
  [[nodiscard]] std::size_t ownerOf(Coord brick) const {
    const auto contains = [&](const BrickChunk& chunk) { return chunk.box.contains(brick); };
    return std::size_t(std::find_if(chunks_.begin(), chunks_.end(), contains) - chunks_.begin());
  }
  /// True if a brick belongs to a chunk that is fitted later.
  [[nodiscard]] bool isOpen(std::size_t c, Coord brick) const {
    const std::size_t owner = ownerOf(brick);
    return owner != c && !states_[owner].begun;
  }

  /// Divides the ellipsoids among the chunks, for the error that the fits left so far.
  void divideCount() {
    std::vector<ChunkNeed> needs;
    for (std::size_t c = 0; c < states_.size(); ++c) {
      const ChunkState& state = states_[c];
      const std::uint64_t voxels = chunks_[c].activeVoxels;
      needs.push_back({.error = state.errors.squaredSumActive,
                       .count = state.begun ? double(state.ellipsoids().size()) : double(voxels),
                       .least = std::max(state.ellipsoids().size(), state.firstCount),
                       .most = voxels});
    }
    const auto counts = dividedCount(plannedCount(options_, activeVoxels_), needs);
    for (std::size_t c = 0; c < states_.size(); ++c) {
      states_[c].count = counts[c];
      if (!states_[c].begun && counts[c] > 0)
        states_[c].firstCount = firstSeeds(counts[c], tuning_);
    }
  }

  /// Gives every ellipsoid to the chunk that contains its center now and sees all around it.
  void reassign() {
    std::vector<FitState> moved(states_.size());
    for (const ChunkState& state : states_)
      for (std::size_t i = 0; i < state.ellipsoids().size(); ++i) {
        FitState& owner = moved[ownerOf(brickWith(state.ellipsoids()[i]))];
        owner.ellipsoids.push_back(state.ellipsoids()[i]);
        owner.adam.push_back(state.fit.adam[i]);
      }
    for (std::size_t c = 0; c < states_.size(); ++c) states_[c].fit = std::move(moved[c]);
  }

  void takeStart() {
    std::vector<std::vector<Ellipsoid>> parts(states_.size());
    for (const Ellipsoid& p : importField(*options_.start, volume_.origin, scene_.scale.scale))
      parts[ownerOf(brickWith(p))].push_back(p);
    for (std::size_t c = 0; c < states_.size(); ++c) {
      ChunkState& state = states_[c];
      state.firstCount = parts[c].size();
      state.begun = true;
      state.fit = stateOf(std::move(parts[c]));
    }
  }

  /// Fits the chunks of a group for a round. None of them sees what the others become.
  void fitGroup(const std::vector<std::size_t>& group, int round) {
    std::vector<ChunkState> made;
    for (const std::size_t c : group) {
      if (isCancelled()) break;
      made.push_back(fitChunk(c, round));
    }
    for (std::size_t n = 0; n < made.size(); ++n) states_[group[n]] = std::move(made[n]);
  }

  /// The ellipsoids of other chunks whose supports may reach a chunk or its halo.
  [[nodiscard]] std::vector<Ellipsoid> ghostsOf(std::size_t c) const {
    const double radius = supportRadius(kernelConstants<double>(kernel_));
    const Box around = dilated(chunks_[c].bounds, scene_.halo);
    const Box possible = dilated(around, bricksIn(radius * tuning_.largestScale));
    std::vector<Ellipsoid> ghosts;
    for (std::size_t other = 0; other < states_.size(); ++other) {
      if (other == c) continue;
      for (const Ellipsoid& p : states_[other].ellipsoids()) {
        const Coord brick = brickWith(p);
        if (possible.contains(brick) && dilated(around, reachOf(p, radius)).contains(brick))
          ghosts.push_back(p);
      }
    }
    return ghosts;
  }

  /// Factor of a chunk's ellipsoids in its first round. The bricks in its halo whose chunks are
  /// fitted later get ellipsoids too, which are dropped afterwards.
  [[nodiscard]] double excessOf(std::size_t c, const ChunkTarget& part) const {
    std::uint64_t open = 0;
    for (std::size_t b = 0; b < part.target.bricks.size(); ++b)
      if (isOpen(c, part.target.bricks[b])) open += std::uint64_t(part.active[b].count());
    return 1.0 + double(open) / double(chunks_[c].activeVoxels);
  }

  [[nodiscard]] RunPlan planFor(std::size_t c, const ChunkTarget& part, int round) const {
    const ChunkState& state = states_[c];
    const double excess = excessOf(c, part);
    RunPlan plan;
    plan.count = std::size_t(excess * double(state.count));
    plan.firstCount = std::size_t(excess * double(state.firstCount));
    plan.iterations = plannedIterations(options_);
    plan.start = state.fit;
    plan.psnr = options_.psnr;
    plan.learnKappa = !options_.kappa && c == 0;
    plan.from = double(round) / kRounds;
    plan.to = double(round + 1) / kRounds;
    if (options_.seconds)
      plan.seconds =
          *options_.seconds / kRounds * double(chunks_[c].activeVoxels) / double(activeVoxels_);
    return plan;
  }

  /// Options whose progress is that of the whole fit, while a part of it is run.
  [[nodiscard]] CommonFitOptions reportedBy(std::size_t c, const RunPlan& plan) const {
    CommonFitOptions options = options_;
    if (!options_.progress) return options;
    const double share = double(chunks_[c].activeVoxels) / double(activeVoxels_);
    std::size_t others = 0;
    for (std::size_t n = 0; n < states_.size(); ++n)
      if (n != c) others += states_[n].ellipsoids().size();
    options.progress = [this, share, others, from = plan.from](FitProgress now) {
      now.fraction = totals_.fraction + share * (now.fraction - from);
      now.point.seconds = seconds();
      now.point.ellipsoids += others;
      now.secondsLeft = now.point.seconds * (1.0 / std::max(now.fraction, 1e-6) - 1.0);
      options_.progress(now);
    };
    return options;
  }

  [[nodiscard]] std::unique_ptr<Optimiser> optimiserOf(std::size_t c,
                                                       const FitTarget& target) const {
    constexpr int kChunkBits = 40;  // above those by which an optimiser varies its seed
    const std::uint64_t seed = options_.seed ^ (std::uint64_t(c + 1) << kChunkBits);
    return makeOptimiser(target, {kernel_, seed, options_.device, options_.maxDeviceBytes},
                         tuning_);
  }

  void makeTargetOf(std::size_t c, ChunkTarget& part) const {
    const auto ghosts = ghostsOf(c);
    makeChunkTarget(
        scene_, chunks_[c], {ghosts, kernel_}, [&](Coord brick) { return isOpen(c, brick); }, part);
    applyOptions(options_, part.target);
  }

  /// The sum of squares over the active voxels of a brick if nothing is fitted.
  [[nodiscard]] double energyOf(std::uint32_t brick) const {
    const auto values = volume_.brickValues(brick);
    double energy = 0.0;
    for (int v = 0; v < kBrickVoxels; ++v) {
      const double value = (double(values[v]) - volume_.background) * scene_.scale.scale;
      if (volume_.active[brick].test(v)) energy += value * value;
    }
    return energy;
  }
  [[nodiscard]] double energyOf(const BrickChunk& chunk) const {
    std::vector<double> energy(chunk.bricks.size());
    tbb::parallel_for(std::size_t{0}, energy.size(),
                      [&](std::size_t n) { energy[n] = energyOf(chunk.bricks[n]); });
    return std::accumulate(energy.begin(), energy.end(), 0.0);
  }

  [[nodiscard]] ChunkState fitChunk(std::size_t c, int round) {
    ChunkTarget part;
    makeTargetOf(c, part);
    ChunkState made = states_[c];
    made.begun = true;
    if (isZero(part.target) || made.count == 0) return made;
    const RunPlan plan = planFor(c, part, round);
    const CommonFitOptions options = reportedBy(c, plan);
    Recorder recorder(part.target, options);
    const auto optimiser = optimiserOf(c, part.target);
    addUp(*optimiser, esvr::run(*optimiser, part.target, recorder, plan, tuning_));
    totals_.fraction +=
        (plan.to - plan.from) * double(chunks_[c].activeVoxels) / double(activeVoxels_);
    if (round + 1 == kRounds) optimiser->dropUnseen();
    takeKernel(optimiser->kernel());
    made.errors = optimiser->measure();
    made.pairs = optimiser->pairCount();
    made.fit = withoutOpen(c, optimiser->state());
    return made;
  }

  /// Takes the kappa that a chunk has found. All ellipsoids keep their half widths.
  void takeKernel(const Kernel& kernel) {
    if (kernel == kernel_) return;
    const auto widthOf = [](const Kernel& k) { return kernelWidth(kernelConstants<double>(k)).m; };
    const double factor = std::sqrt(widthOf(kernel) / widthOf(kernel_));
    for (ChunkState& state : states_)
      for (Ellipsoid& p : state.fit.ellipsoids) shrinkBy(p, factor);
    kernel_ = kernel;
  }

  /// Drops the ellipsoids in chunks that are fitted later.
  [[nodiscard]] FitState withoutOpen(std::size_t c, const FitState& all) const {
    FitState kept;
    for (std::size_t i = 0; i < all.ellipsoids.size(); ++i) {
      if (isOpen(c, brickWith(all.ellipsoids[i]))) continue;
      kept.ellipsoids.push_back(all.ellipsoids[i]);
      kept.adam.push_back(all.adam[i]);
    }
    return kept;
  }

  void addUp(const Optimiser& optimiser, const RunEnd& end) {
    if (!isCancelled()) totals_.end = end.end;
    totals_.iterations = std::max(totals_.iterations, end.iterations);
    totals_.deviceBytes = std::max(totals_.deviceBytes, optimiser.deviceBytes());
    totals_.deviceFull |= optimiser.deviceFull();
    totals_.secondsSeed += optimiser.secondsSeeding();
  }

  /// The last point of the curve.
  [[nodiscard]] TimedCurvePoint lastPoint(std::size_t ellipsoids) const {
    FitErrors errors;
    for (const ChunkState& state : states_) errors.add(state.errors);
    TimedCurvePoint point;
    point.seconds = seconds();
    point.iteration = totals_.iterations;
    point.ellipsoids = ellipsoids;
    point.psnrBox = psnrOf(errors.squaredSumBox, scene_.box.volume(), scene_.scale.peak);
    point.psnrActive = psnrOf(errors.squaredSumActive, double(activeVoxels_), scene_.scale.peak);
    point.maxError = errors.largest / scene_.scale.scale;
    return point;
  }

  [[nodiscard]] FitEnd endAt(double psnr) const {
    if (!options_.psnr || isCancelled()) return totals_.end;
    if (psnr > *options_.psnr) return FitEnd::kPsnrReached;
    return options_.seconds ? FitEnd::kTimeUp : FitEnd::kPsnrMissed;
  }

  [[nodiscard]] FitResult result() {
    std::vector<Ellipsoid> all;
    for (const ChunkState& state : states_)
      all.insert(all.end(), state.ellipsoids().begin(), state.ellipsoids().end());
    if (isCancelled() && all.empty()) throw Cancelled();
    FitResult result;
    result.secondsOptimise = seconds() - totals_.secondsSeed;
    result.secondsSeed = totals_.secondsSeed;
    result.curve.push_back(lastPoint(all.size()));
    result.field =
        exportField(all, {volume_.origin, scene_.scale.scale, volume_.background, kernel_});
    result.field.fitFor = options_.fitFor;
    result.range = rangeOf(volume_.background, scene_.scale);
    result.kappaLearned = !options_.kappa;
    result.end = endAt(result.curve.back().psnrBox);
    result.wanted = plannedCount(options_, activeVoxels_);
    result.chunks = chunks_.size();
    result.deviceBytes = totals_.deviceBytes;
    result.deviceFull = totals_.deviceFull;
    for (const ChunkState& state : states_) result.pairs += state.pairs;
    result.signedIntensities = anyNegative(all);
    return result;
  }

  const SparseVolume& volume_;
  const FitOptions& options_;
  Tuning tuning_;
  std::span<const BrickChunk> chunks_;
  std::uint64_t activeVoxels_;
  ChunkScene scene_;
  std::vector<ChunkState> states_;
  Kernel kernel_;
  Totals totals_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace

FitResult fitInChunks(const SparseVolume& volume, const FitOptions& options,
                      const TargetScale& scale, std::span<const BrickChunk> chunks) {
  return ChunkedFit(volume, options, scale, chunks).run();
}

}  // namespace esvr
