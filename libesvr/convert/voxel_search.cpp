#include "convert/voxel_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "esvr/grid_coding.h"
#include "esvr/voxel_layer.h"

namespace esvr::convert {
namespace {

// Bounds are counted in octaves below the range of the values: 1 is half the range.
constexpr double kCoarsest = 1.0, kFinest = 24.0;  // float32 has 24 bits
constexpr double kDbPerOctave = 6.02;              // gain of PSNR by half the bound
constexpr double kDoublingsPerOctave = 0.5;        // usual growth of the bytes by half the bound
constexpr double kPsnrTolerance = 0.05;            // dB above the wanted PSNR that end a search
constexpr double kSizeTolerance = 0.01;            // share of the bytes that may stay unused
constexpr int kMaxTrials = 10;
constexpr int kCoarserTrials = 10;     // number of coarser bounds that takeCoarser tries
constexpr double kCoarserStep = 0.04;  // octaves between them
constexpr double kNarrowest = 0.002;   // octaves; a bound that differs by 0.14 % is not tried

/// Finds the octave at which a figure that grows with it reaches an aim: by a usual slope while all
/// trials lie on one side, then by interpolation between the two sides.
class OctaveSearch {
 public:
  OctaveSearch(double aim, double slope, double first)
      : aim_(aim), slope_(slope), next_(std::clamp(first, kCoarsest, kFinest)) {}

  [[nodiscard]] double next() const { return next_; }
  [[nodiscard]] bool ended() const { return high_.octave - low_.octave < kNarrowest; }

  /// Takes the figure at next().
  void learn(double figure) {
    (figure < aim_ ? low_ : high_) = {next_, figure};
    const double width = high_.octave - low_.octave;
    double share = 0.5;
    if (low_.known() && high_.known())
      share = (aim_ - low_.figure) / (high_.figure - low_.figure);
    else if (std::isfinite(figure))
      share = (next_ + kOvershoot * (aim_ - figure) / slope_ - low_.octave) / width;
    next_ = low_.octave + width * std::clamp(share, kInside, 1.0 - kInside);
  }

 private:
  struct Side {
    double octave, figure = std::numeric_limits<double>::quiet_NaN();
    [[nodiscard]] bool known() const { return std::isfinite(figure); }
  };
  static constexpr double kOvershoot = 1.1;  // so that the aim comes to lie between two trials
  static constexpr double kInside = 0.02;    // distance from both sides, relative to the interval

  double aim_, slope_, next_;
  Side low_{kCoarsest - kNarrowest}, high_{kFinest + kNarrowest};
};

VoxelCandidate candidate(const Job& job, VoxelLayer layer, double psnr) {
  VoxelCandidate made;
  made.grid = makeStoredVoxels(job.input.descriptor, job.input.source, std::move(layer));
  made.bytes = bytesAdded(made.grid);
  made.psnr = psnr;
  return made;
}

class VoxelSearch {
 public:
  explicit VoxelSearch(const Job& job) : job_(job) {
    const ValueRange range = activeRange(job.input.source);
    const double background = job.input.source.background;
    range_ = std::max(double(range.max), background) - std::min(double(range.min), background);
  }

  std::optional<VoxelCandidate> forPsnr(double psnr) {
    OctaveSearch search(psnr + 0.3 * kPsnrTolerance, kDbPerOctave, psnr / kDbPerOctave - 1.0);
    std::optional<Trial> best;
    for (int n = 0; range_ > 0.0 && n < kMaxTrials && !search.ended(); ++n) {
      Trial now = tryAt(search.next());
      search.learn(now.psnr);
      if (now.psnr >= psnr && (!best || now.octave < best->octave)) best = std::move(now);
      if (best && best->psnr < psnr + kPsnrTolerance) break;
    }
    if (!best) return exactVoxels(job_);
    takeCoarser(psnr, *best);
    return candidate(job_, std::move(best->layer), best->psnr);
  }

  std::optional<VoxelCandidate> forSize(std::uint64_t bytes) {
    std::optional<VoxelCandidate> best = exactVoxels(job_);
    if (best && best->bytes <= bytes) return best;
    best.reset();
    const double aim = std::log2(double(bytes)) + std::log2(1.0 - 0.3 * kSizeTolerance);
    const double bits = 8.0 * double(bytes) / double(activeVoxelCount(job_.input.source));
    OctaveSearch search(aim, kDoublingsPerOctave, 2.0 + bits);
    for (int n = 0; range_ > 0.0 && n < kMaxTrials && !search.ended(); ++n) {
      VoxelCandidate now = candidate(job_, layerAt(search.next()), 0.0);
      search.learn(std::log2(double(now.bytes)));
      if (now.bytes <= bytes && (!best || now.bytes > best->bytes)) best = std::move(now);
      if (best && double(best->bytes) >= (1.0 - kSizeTolerance) * double(bytes)) break;
    }
    if (best) best->psnr = psnrOf(job_, best->grid);
    return best;
  }

 private:
  [[nodiscard]] VoxelLayer layerAt(double octave) const {
    return boundedLayer(job_.input.source, range_ * std::exp2(-octave),
                        job_.options.storage.activity);
  }

  struct Trial {
    double octave, psnr;
    VoxelLayer layer;
  };

  [[nodiscard]] Trial tryAt(double octave) const {
    VoxelLayer layer = layerAt(octave);
    const double psnr = psnrOf(job_, volumeOf(layer));
    return {octave, psnr, std::move(layer)};
  }

  /// Looks for a coarser bound. Values that have few levels, such as those of 8 bits, lie nearer to
  /// one lattice than to another, so that their PSNR is not monotone in the bound.
  void takeCoarser(double psnr, Trial& best) const {
    if (exactLayer(job_.input.source).form != VoxelForm::kPalette) return;
    const double from = best.octave;
    for (int n = kCoarserTrials; n > 0; --n) {
      Trial now = tryAt(std::max(from - n * kCoarserStep, kCoarsest));
      if (now.psnr < psnr) continue;
      best = std::move(now);
      return;
    }
  }

  const Job& job_;
  double range_ = 0.0;
};

}  // namespace

std::optional<VoxelCandidate> exactVoxels(const Job& job) {
  if (job.input.descriptor.valueType == ValueType::kDouble) return std::nullopt;
  return candidate(job, exactLayer(job.input.source), std::numeric_limits<double>::infinity());
}

std::optional<VoxelCandidate> voxelsForPsnr(const Job& job, double psnr) {
  return VoxelSearch(job).forPsnr(psnr);
}

std::optional<VoxelCandidate> voxelsForSize(const Job& job, std::uint64_t bytes) {
  return VoxelSearch(job).forSize(bytes);
}

}  // namespace esvr::convert
