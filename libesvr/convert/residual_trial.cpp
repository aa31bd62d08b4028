#include "convert/residual_trial.h"

#include <algorithm>
#include <limits>
#include <vector>

#include "convert/sample.h"
#include "esvr/field.h"
#include "format/voxel_section.h"

namespace esvr::convert {
namespace {

// docs/lab-notes.md, "Deciding on a residual", has the ratios for these and other values.
constexpr std::uint32_t kShortIterations = 200;
/// Ratio after a short fit from which on a longer one does not help enough.
constexpr double kHopelessRatio = 1.15;
constexpr std::size_t kMinBricks = 32, kMaxBricks = 96;
constexpr std::size_t kBricksPerRun = 4;
constexpr std::size_t kSampledFraction = 8;  // one of 8 bricks, between these limits

SampleSize trialSize(std::size_t bricks) {
  const std::size_t wanted = std::clamp(bricks / kSampledFraction, kMinBricks, kMaxBricks);
  return {wanted, wanted / kBricksPerRun};
}

/// The error of a fit at the voxels of its source.
SparseVolume errorOf(const SparseVolume& source, const FitResult& fit) {
  std::vector<Coord> corners;
  for (std::size_t b = 0; b < source.brickCount(); ++b) corners.push_back(source.brickCorner(b));
  const SparseVolume sum = revoxelise(fit.field, {.threshold = -std::numeric_limits<float>::max(),
                                                  .range = fit.range,
                                                  .bricks = corners,
                                                  .restrictToBricks = true});
  SparseVolume error = source;
  error.background = 0.0f;
  for (std::size_t i = 0; i < error.values.size(); ++i) error.values[i] -= sum.values[i];
  return error;
}

double bytesWithin(const SparseVolume& volume, double bound, Activity activity) {
  return double(format::putVoxels(boundedLayer(volume, bound, activity)).size());
}

/// The fits of one sample of a volume, which take the same number of ellipsoids.
class ResidualTrial {
 public:
  ResidualTrial(const Job& job, double bound, double share)
      : sample_(sampleOf(job.input.source, trialSize(job.input.source.brickCount()))),
        bound_(bound),
        share_(share),
        voxels_(bytesWithin(sample_, bound, voxelActivity(job))) {
    const FitOptions& given = job.options.fit;
    options_.count = std::size_t(std::max(share * voxels_ / kBytesPerEllipsoid, 1.0));
    options_.narrowBand = true;  // voxels beside the sample are unknown
    options_.kappa = given.kappa;
    options_.seed = given.seed;
    options_.cancel = given.cancel;
  }

  [[nodiscard]] double ratioAfter(std::uint32_t iterations, bool bothSigns) {
    options_.iterations = iterations;
    options_.bothSigns = bothSigns;
    const SparseVolume error = errorOf(sample_, fit(sample_, options_));
    return share_ + bytesWithin(error, bound_, Activity::kByValue) / voxels_;
  }

 private:
  SparseVolume sample_;
  double bound_, share_, voxels_;
  FitOptions options_;
};

}  // namespace

double residualRatio(const Job& job, double bound, double share) {
  const FitOptions& options = job.options.fit;
  const std::uint32_t whole = plannedIterations(options);
  const std::uint32_t brief = std::min(kShortIterations, whole);
  ResidualTrial trial(job, bound, share);
  bool both = options.bothSigns.value_or(false);
  double ratio = trial.ratioAfter(brief, both);
  if (ratio >= kHopelessRatio) return ratio;
  if (!options.bothSigns && saturates(job.input.source)) {
    const double other = trial.ratioAfter(brief, true);
    both = other < ratio;
    ratio = std::min(ratio, other);
  }
  return whole > brief ? std::min(ratio, trial.ratioAfter(whole, both)) : ratio;
}

}  // namespace esvr::convert
