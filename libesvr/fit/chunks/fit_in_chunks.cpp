#include "fit/chunks/fit_in_chunks.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "esvr/error.h"
#include "fit/chunks/chunk_state.h"
#include "fit/chunks/chunk_target.h"
#include "fit/chunks/divide_count.h"
#include "fit/chunks/part.h"
#include "fit/chunks/round.h"
#include "fit/ellipsoid_math.h"
#include "fit/export_field.h"
#include "fit/fit_plan.h"
#include "fit/import_field.h"
#include "fit/recorder.h"

namespace esvr {
namespace {

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
        scene_{{volume, chunks, scale, boxOf(volume, options.box),
                haloBricks(activeVoxels_, plannedCount(options, activeVoxels_))},
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
    const Round round(scene_, {number, kernel_}, states_, progress_, turns_);
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
