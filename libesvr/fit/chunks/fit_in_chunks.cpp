#include "fit/chunks/chunks.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>

#include "core/parallel.h"
#include "esvr/error.h"

namespace esvr {

// --- The progress.

WholeProgress::WholeProgress(const FitScene& scene, std::function<void(const FitProgress&)> report)
    : report_(std::move(report)), boxVoxels_(scene.box.volume()) {
  for (const BrickChunk& chunk : scene.chunks) activeVoxels_ += chunk.activeVoxels;
  for (const BrickChunk& chunk : scene.chunks)
    chunks_.push_back({.share = double(chunk.activeVoxels) / double(activeVoxels_),
                       .boxVoxels = boxOf(scene, chunk).volume()});
}

double WholeProgress::seconds() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
}

std::function<void(const FitProgress&)> WholeProgress::of(std::size_t chunk) {
  if (!report_) return {};
  return [this, chunk](const FitProgress& now) {
    const std::lock_guard lock(mutex_);
    Chunk& state = chunks_[chunk];
    state.fraction = std::max(state.fraction, now.fraction);
    state.squares = state.boxVoxels * std::pow(10.0, -0.1 * now.point.psnrBox);
    state.ellipsoids = now.point.ellipsoids;
    report_(whole());
  };
}

void WholeProgress::end(std::size_t chunk, const PartEnd& part, double fraction) {
  const std::lock_guard lock(mutex_);
  // A part ends at a whole iteration, which may be a little later.
  chunks_[chunk].fraction = std::max(chunks_[chunk].fraction, fraction);
  chunks_[chunk].ellipsoids = part.fit.ellipsoids.size();
  ++partsDone_;
  if (report_) report_(whole());
}

FitProgress WholeProgress::whole() const {
  FitProgress now;
  double squares = 0.0;
  for (const Chunk& chunk : chunks_) {
    now.fraction += chunk.share * chunk.fraction;
    now.point.ellipsoids += chunk.ellipsoids;
    squares += chunk.squares;
  }
  now.fraction = std::min(1.0, now.fraction);  // the shares are rounded
  now.point.seconds = seconds();
  now.point.psnrBox = psnrOf(squares, boxVoxels_, 1.0);
  now.parts = chunks_.size() * kRounds;
  now.partsDone = partsDone_;
  addRates(now, activeVoxels_);
  return now;
}

namespace {

// --- The state between two rounds.

/// The fit of one chunk after a round.
struct ChunkState {
  FitState fit;                ///< the ellipsoids whose centers are in the chunk's box
  std::size_t firstCount = 0;  ///< ellipsoids at the start of growth
  std::size_t wanted = 0;      ///< ellipsoids at the end of growth
  FitErrors errors;            ///< errors of its part of the box when it was last fitted
  std::uint64_t pairs = 0;     ///< pairs of the ellipsoids in the chunk and its halo, and bricks

  [[nodiscard]] std::size_t count() const { return fit.ellipsoids.size(); }
};

double energyOf(const FitScene& scene, std::uint32_t brick) {
  const SparseVolume& volume = scene.volume;
  const auto values = volume.brickValues(brick);
  double energy = 0.0;
  for (int v = 0; v < kBrickVoxels; ++v) {
    const double value = (double(values[v]) - volume.background) * scene.scale.scale;
    if (volume.active[brick].test(v)) energy += value * value;
  }
  return energy;
}

/// A number to which the integral of an ellipsoid's square is proportional.
double energyOf(const Ellipsoid& p) {
  return p.intensity * p.intensity / std::abs(ellipsoid_math::asEigen(p.L).determinant());
}

FitState without(const FitState& fit, const std::vector<bool>& dropped) {
  FitState kept;
  for (std::size_t i = 0; i < fit.ellipsoids.size(); ++i) {
    if (dropped[i]) continue;
    kept.ellipsoids.push_back(fit.ellipsoids[i]);
    kept.adam.push_back(fit.adam[i]);
  }
  return kept;
}

/// Sum of squares over a chunk's active voxels if nothing is fitted.
double energyOf(const FitScene& scene, const BrickChunk& chunk) {
  std::vector<double> energy(chunk.bricks.size());
  parallelFor(std::size_t{0}, energy.size(),
              [&](std::size_t n) { energy[n] = energyOf(scene, chunk.bricks[n]); });
  return std::accumulate(energy.begin(), energy.end(), 0.0);
}

/// Drops the faintest ellipsoids beyond `most`. A chunk may end a round with a few more ellipsoids
/// than it should, because those in its halo may move or be relocated into it.
void dropSurplus(std::size_t most, std::vector<ChunkState>& states) {
  struct Item {
    double energy;
    std::size_t chunk, index;
    auto operator<=>(const Item&) const = default;
  };
  std::vector<Item> items;
  for (std::size_t c = 0; c < states.size(); ++c)
    for (std::size_t i = 0; i < states[c].count(); ++i)
      items.push_back({energyOf(states[c].fit.ellipsoids[i]), c, i});
  if (items.size() <= most) return;
  const auto end = items.end() - std::ptrdiff_t(most);
  std::nth_element(items.begin(), end, items.end());
  std::vector<std::vector<bool>> dropped;
  for (const ChunkState& state : states) dropped.emplace_back(state.count());
  for (auto item = items.begin(); item != end; ++item) dropped[item->chunk][item->index] = true;
  for (std::size_t c = 0; c < states.size(); ++c)
    states[c].fit = without(states[c].fit, dropped[c]);
}

// --- A round.

int bricksIn(double voxels) { return int(std::ceil(voxels / kBrickSide)); }

/// A number of bricks beyond which a support does not reach from its center's brick.
int reachOf(const Ellipsoid& p, double radius) {
  return bricksIn(radius * std::sqrt(ellipsoid_math::norm2(inverse(p.L))));
}

/// Every chunk is fitted with its halo for a part of the schedule. The parts begin with the
/// ellipsoids of the round before and do not see each other.
class Round : public RoundParts {
 public:
  /// All arguments must outlive the round.
  Round(const FitScene& scene, int number, const Kernel& kernel, std::span<const ChunkState> states,
        WholeProgress& progress, DeviceTurns& turns)
      : scene_(scene),
        number_(number),
        kernel_(kernel),
        states_(states),
        progress_(progress),
        turns_(turns) {}

  [[nodiscard]] int round() const override { return number_; }
  [[nodiscard]] std::size_t count() const override { return states_.size(); }
  [[nodiscard]] PartKey keyOf(std::size_t part) const override {
    return esvr::keyOf(scene_, startOf(part));
  }
  [[nodiscard]] PartOutput fit(std::size_t part, const Device& device) const override;

 private:
  [[nodiscard]] PartEnd fitted(const PartStart& start, const Device& device) const;
  [[nodiscard]] PartStart startOf(std::size_t chunk) const;
  [[nodiscard]] RunPlan runPlanOf(std::size_t chunk) const;
  void takeAround(std::size_t chunk, PartStart& start) const;
  struct Halo {
    Box box;        ///< box of bricks
    Box possible;   ///< bricks from which ellipsoids may reach into it
    double radius;  ///< radius of a support, relative to its scales
  };
  [[nodiscard]] double takeFrom(std::size_t other, const Halo& halo, PartStart& start) const;
  [[nodiscard]] double shareWithin(const Box& box, const BrickChunk& chunk) const;

  const FitScene& scene_;
  int number_;
  Kernel kernel_;
  std::span<const ChunkState> states_;
  WholeProgress& progress_;
  DeviceTurns& turns_;
};

PartOutput Round::fit(std::size_t part, const Device& device) const {
  const PartStart start = startOf(part);
  const PartEnd end = fitted(start, device);
  progress_.end(part, end, start.plan.to);
  return {bytesOf(end), end.end != FitEnd::kCancelled};
}

/// Fits a part, unless the fit is cancelled.
PartEnd Round::fitted(const PartStart& start, const Device& device) const {
  const CancelToken* own = scene_.options.cancel;
  try {
    if (!CancelScope::cancelled() && !(own && own->cancelled()))
      return fitPart(scene_, start, {device, turns_, progress_.of(start.chunk)});
  } catch (const Cancelled&) {
  }
  PartEnd end = unchanged(scene_, start);
  end.end = FitEnd::kCancelled;
  return end;
}

PartStart Round::startOf(std::size_t chunk) const {
  PartStart start;
  start.chunk = chunk;
  start.kernel = kernel_;
  start.plan = runPlanOf(chunk);
  takeAround(chunk, start);
  start.errors = states_[chunk].errors;
  start.pairs = states_[chunk].pairs;
  return start;
}

RunPlan Round::runPlanOf(std::size_t chunk) const {
  const ChunkState& state = states_[chunk];
  const FitOptions& options = scene_.options;
  RunPlan plan;
  plan.count = state.wanted;
  plan.firstCount = state.firstCount;
  plan.iterations = plannedIterations(options);
  plan.start = state.fit;
  plan.psnr = options.psnr;
  plan.from = kRoundEnds[number_];
  plan.to = kRoundEnds[number_ + 1];
  plan.curve = false;
  plan.learnKappa = !options.kappa && plan.from < kKappaUntil;
  if (options.seconds)
    plan.seconds = *options.seconds * (plan.to - plan.from) * progress_.shareOf(chunk);
  return plan;
}

/// Takes the ellipsoids of the other chunks. Those in the halo are fitted too and dropped at the end
/// of the part. During the part they change as they do in the parts of their own chunks, because the
/// voxels and the first state are the same. The ellipsoids on both sides of a plane can therefore
/// adapt to each other although the parts do not communicate.
void Round::takeAround(std::size_t chunk, PartStart& start) const {
  const double radius = supportRadius(kernelConstants<double>(kernel_));
  const Box halo = dilated(scene_.chunks[chunk].bounds, scene_.halo);
  const Box possible = dilated(halo, bricksIn(radius * Tuning{}.largestScale));
  double count = double(start.plan.count), firstCount = double(start.plan.firstCount);
  for (std::size_t other = 0; other < states_.size(); ++other) {
    if (other == chunk || common(possible, scene_.chunks[other].box).empty()) continue;
    const double share = takeFrom(other, {halo, possible, radius}, start);
    count += share * double(states_[other].wanted);
    firstCount += share * double(states_[other].firstCount);
  }
  start.plan.count = std::size_t(count);
  start.plan.firstCount = std::size_t(firstCount);
}

/// Takes the ellipsoids of another chunk that are in the halo or reach into it.
/// \return the share that is in the halo; before there are ellipsoids, that of the active voxels
double Round::takeFrom(std::size_t other, const Halo& halo, PartStart& start) const {
  const FitState& fit = states_[other].fit;
  if (fit.ellipsoids.empty()) return shareWithin(halo.box, scene_.chunks[other]);
  std::size_t inside = 0;
  for (std::size_t i = 0; i < fit.ellipsoids.size(); ++i) {
    const Ellipsoid& p = fit.ellipsoids[i];
    const Coord brick = brickWith(p);
    if (!halo.possible.contains(brick)) continue;
    if (halo.box.contains(brick)) {
      start.plan.start.ellipsoids.push_back(p);
      start.plan.start.adam.push_back(fit.adam[i]);
      ++inside;
    } else if (dilated(halo.box, reachOf(p, halo.radius)).contains(brick)) {
      start.ghosts.push_back(p);
    }
  }
  return double(inside) / double(fit.ellipsoids.size());
}

/// The share of a chunk's active voxels in a box of bricks.
double Round::shareWithin(const Box& box, const BrickChunk& chunk) const {
  std::uint64_t active = 0;
  if (common(box, chunk.bounds).empty()) return 0.0;
  for (const std::uint32_t b : chunk.bricks)
    if (box.contains(scene_.volume.bricks[b]))
      active += std::uint64_t(scene_.volume.active[b].count());
  return double(active) / double(chunk.activeVoxels);
}

// --- All rounds.

/// Runs one part after the other on one device.
class InOrder : public PartRunner {
 public:
  explicit InOrder(const Device& device) : device_(device) {}
  std::vector<std::vector<std::byte>> run(const RoundParts& parts) override {
    std::vector<std::vector<std::byte>> outputs;
    for (std::size_t p = 0; p < parts.count(); ++p) outputs.push_back(parts.fit(p, device_).bytes);
    return outputs;
  }

 private:
  Device device_;
};

/// What the parts add up to.
struct Totals {
  FitEnd end = FitEnd::kScheduleDone;
  std::uint32_t iterations = 0;
  std::uint64_t deviceBytes = 0;
  bool deviceFull = false;
  double secondsSeed = 0.0;
};

class ChunkedFit {
 public:
  ChunkedFit(const SparseVolume& volume, const FitOptions& options, const TargetScale& scale,
             std::span<const BrickChunk> chunks)
      : options_(options),
        activeVoxels_(activeVoxelCount(volume)),
        scene_{volume,
               chunks,
               scale,
               boxOf(volume, options.box),
               haloBricks(activeVoxels_, plannedCount(options, activeVoxels_)),
               options},
        states_(chunks.size()),
        progress_(scene_, options.progress) {
    kernel_.kappa = firstKappa(options, Tuning{});
    for (std::size_t c = 0; c < chunks.size(); ++c)
      states_[c].errors.squaredSumActive = energyOf(scene_, chunks[c]);
    if (options.start) takeStart();
  }

  FitResult run() {
    for (int n = 0; n < kRounds && !isCancelled(); ++n) {
      divideCount(n);
      runRound(n);
      dropSurplus(plannedCount(options_, activeVoxels_), states_);
    }
    return result();
  }

 private:
  [[nodiscard]] bool isCancelled() const { return totals_.end == FitEnd::kCancelled; }
  [[nodiscard]] bool isFirst(int round) const { return round == 0 && !options_.start; }

  /// The number of the chunk whose box contains an ellipsoid's center.
  [[nodiscard]] std::size_t ownerOf(const Ellipsoid& p) const {
    const Coord brick = brickWith(p);
    const auto contains = [&](const BrickChunk& chunk) { return chunk.box.contains(brick); };
    const auto owner = std::find_if(scene_.chunks.begin(), scene_.chunks.end(), contains);
    return std::size_t(owner - scene_.chunks.begin());
  }

  /// Divides the ellipsoids among the chunks, for the error that the fits left so far.
  void divideCount(int round) {
    std::vector<ChunkNeed> needs;
    for (std::size_t c = 0; c < states_.size(); ++c) {
      const ChunkState& state = states_[c];
      const std::uint64_t voxels = scene_.chunks[c].activeVoxels;
      needs.push_back({.error = state.errors.squaredSumActive,
                       .count = isFirst(round) ? double(voxels) : double(state.count()),
                       .least = std::max(state.count(), state.firstCount),
                       .most = voxels});
    }
    const auto counts = dividedCount(plannedCount(options_, activeVoxels_), needs);
    for (std::size_t c = 0; c < states_.size(); ++c) {
      states_[c].wanted = counts[c];
      if (isFirst(round) && counts[c] > 0) states_[c].firstCount = firstSeeds(counts[c], Tuning{});
    }
  }

  void runRound(int number) {
    const Round round(scene_, number, kernel_, states_, progress_, turns_);
    InOrder inOrder(options_.device);
    PartRunner& runner = options_.parts ? *options_.parts : inOrder;
    const auto outputs = runner.run(round);
    std::vector<Kernel> kernels;
    for (std::size_t c = 0; c < states_.size(); ++c) {
      PartEnd part = partOf(outputs[c]);
      addUp(part);
      kernels.push_back(part.kernel);
      states_[c].errors = part.errors;
      states_[c].pairs = part.pairs;
      states_[c].fit = std::move(part.fit);
    }
    takeMeanKappa(kernels);
  }

  /// Takes the mean of the kappas that the chunks have found, weighted by their ellipsoids. All
  /// ellipsoids keep their half widths.
  void takeMeanKappa(std::span<const Kernel> kernels) {
    double sum = 0.0, weight = 0.0;
    for (std::size_t c = 0; c < states_.size(); ++c) {
      sum += double(states_[c].count()) * double(kernels[c].kappa);
      weight += double(states_[c].count());
    }
    if (weight > 0.0) kernel_.kappa = float(sum / weight);
    const auto widthOf = [](const Kernel& k) { return kernelWidth(kernelConstants<double>(k)).m; };
    for (std::size_t c = 0; c < states_.size(); ++c) {
      if (kernels[c] == kernel_) continue;
      const double factor = std::sqrt(widthOf(kernel_) / widthOf(kernels[c]));
      for (Ellipsoid& p : states_[c].fit.ellipsoids) shrinkBy(p, factor);
    }
  }

  void takeStart() {
    std::vector<std::vector<Ellipsoid>> parts(states_.size());
    for (const Ellipsoid& p :
         importField(*options_.start, scene_.volume.origin, scene_.scale.scale))
      parts[ownerOf(p)].push_back(p);
    for (std::size_t c = 0; c < states_.size(); ++c) {
      states_[c].firstCount = parts[c].size();
      states_[c].fit = stateOf(std::move(parts[c]));
    }
  }

  void addUp(const PartEnd& part) {
    if (!isCancelled()) totals_.end = part.end;
    totals_.iterations = std::max(totals_.iterations, part.iterations);
    totals_.deviceBytes = std::max(totals_.deviceBytes, part.deviceBytes);
    totals_.deviceFull |= part.deviceFull;
    totals_.secondsSeed += part.secondsSeed;
  }

  /// The last point of the curve.
  [[nodiscard]] TimedCurvePoint lastPoint(std::size_t ellipsoids) const {
    FitErrors errors;
    for (const ChunkState& state : states_) errors.add(state.errors);
    TimedCurvePoint point;
    point.seconds = progress_.seconds();
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

  [[nodiscard]] FitResult result() const {
    const SparseVolume& volume = scene_.volume;
    std::vector<Ellipsoid> all;
    for (const ChunkState& state : states_)
      all.insert(all.end(), state.fit.ellipsoids.begin(), state.fit.ellipsoids.end());
    if (isCancelled() && all.empty()) throw Cancelled();
    const BestSoFar completion;
    FitResult result;
    result.secondsSeed = totals_.secondsSeed;
    result.curve.push_back(lastPoint(all.size()));
    result.secondsOptimise = std::max(0.0, result.curve.back().seconds - totals_.secondsSeed);
    result.field =
        exportField(all, {volume.origin, scene_.scale.scale, volume.background, kernel_});
    result.range = rangeOf(volume.background, scene_.scale);
    result.end = endAt(result.curve.back().psnrBox);
    result.wanted = plannedCount(options_, activeVoxels_);
    result.chunks = scene_.chunks.size();
    result.deviceBytes = totals_.deviceBytes;
    result.deviceFull = totals_.deviceFull;
    for (const ChunkState& state : states_) result.pairs += state.pairs;
    result.signedIntensities = anyNegative(all);
    return result;
  }

  const FitOptions& options_;
  std::uint64_t activeVoxels_;
  FitScene scene_;
  std::vector<ChunkState> states_;
  WholeProgress progress_;
  DeviceTurns turns_;
  Kernel kernel_;
  Totals totals_;
};

}  // namespace

FitResult fitInChunks(const SparseVolume& volume, const FitOptions& options,
                      const TargetScale& scale, std::span<const BrickChunk> chunks) {
  return ChunkedFit(volume, options, scale, chunks).run();
}

}  // namespace esvr
