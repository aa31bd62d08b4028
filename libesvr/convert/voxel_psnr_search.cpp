#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "convert/unless_cancelled.h"
#include "convert/voxel_trials.h"
#include "esvr/grid_coding.h"

#include "core/parallel.h"

namespace esvr::convert {
namespace {

/// Where the bound cannot be chosen freely, higher prices than kPrice use up the PSNR that is left.
constexpr std::array kPlateauPrices{0.0, 0.08, 0.12, 0.2, 0.3};
/// Prices of a bit for voxels that are predicted from another grid, and from the frame before. Voxels
/// whose bits are not worth their price keep to the prediction; in a frame this also means less
/// flicker, so that the price is higher there (docs/lab-notes.md has the figures of other prices).
constexpr double kPredictedPrice = 0.14, kFramePrice = 0.2;
constexpr double kThriftOctaves = 0.08;  // bound's octaves that make up for the loss by kPrice
constexpr int kMaxThriftyTrials = 4, kMaxFrameTrials = 10;
/// Bits of an active voxel of a frame from which on exact voxels are tried, which take 8 at least in
/// all but constant volumes.
constexpr double kBitsOfExact = 8.0;

bool isSmaller(const VoxelCandidate& a, const VoxelCandidate& b) { return a.bytes < b.bytes; }

class VoxelPsnrSearch {
 public:
  VoxelPsnrSearch(const Job& job, double psnr) : job_(job), trials_(job), psnr_(psnr) {}

  /// \param smallEnough  bytes below which nothing further is tried
  /// \return if the search is cancelled, the first voxels that reach the PSNR, without their bytes
  VoxelCandidate run(std::uint64_t smallEnough) const {
    if (!trials_.hasRange()) return exactVoxels(job_);
    auto plain = trials_.nearestFor(psnr_);
    if (!plain) return exactVoxels(job_);
    if (job_.options.previous) return predicted(std::move(*plain));
    if (auto found = unlessCancelled([&] { return std::optional(smallest(*plain, smallEnough)); }))
      return std::move(*found);
    VoxelCandidate best;  // what a file takes for them would take long to find out
    best.grid = makeStoredVoxels(job_.input.descriptor, job_.input.source, std::move(plain->layer));
    best.psnr = plain->psnr;
    return best;
  }

 private:
  /// \param plain  voxels without thrift that reach the PSNR
  [[nodiscard]] VoxelCandidate smallest(const Trial& plain, std::uint64_t smallEnough) const {
    const double bound = plain.bound;
    VoxelCandidate best;
    tbb::task_arena arena(trials_.trialsAtOnce());
    arena.execute([&, token = CancelScope::token()] {
      const CancelScope scope(token);
      best = exactUnless(plain);
      if (best.bytes >= smallEnough) best = furtherTrials(bound, std::move(best));
    });
    if (!best.plateau.tried) best.plateau.seconds = trials_.plateauSeconds();
    return best;
  }

  [[nodiscard]] VoxelCandidate stored(Trial trial) const {
    return candidateOf(job_, std::move(trial.layer), trial.psnr);
  }

  [[nodiscard]] double framePrice() const {
    return job_.options.keepsPastErrors ? kFramePrice : kPredictedPrice;
  }

  /// Thrifty voxels of a frame, or the trial if they do not reach the PSNR. Exact voxels are tried
  /// only if these take so many bits that exact ones may take fewer.
  [[nodiscard]] VoxelCandidate predicted(Trial plain) const {
    const double octave = trials_.octaveOf(plain.bound) + framePrice();
    auto thrifty = trials_.coarsestFor(psnr_, octave, framePrice(), kMaxFrameTrials);
    VoxelCandidate best = stored(std::move(thrifty ? *thrifty : plain));
    const double bits = 8.0 * double(best.bytes) / double(activeVoxelCount(job_.input.source));
    if (bits < kBitsOfExact) return best;
    VoxelCandidate exact = exactVoxels(job_);
    return isSmaller(best, exact) ? std::move(best) : std::move(exact);
  }

  /// Exact voxels, unless the trial is smaller.
  [[nodiscard]] VoxelCandidate exactUnless(Trial trial) const {
    VoxelCandidate exact, rounded;
    parallelInvoke([&] { exact = exactVoxels(job_); }, [&] { rounded = stored(std::move(trial)); });
    return isSmaller(rounded, exact) ? std::move(rounded) : std::move(exact);
  }

  /// The smallest of `best`, thrifty voxels of about the same bound, and voxels with the plateau.
  [[nodiscard]] VoxelCandidate furtherTrials(double bound, VoxelCandidate best) const {
    std::optional<VoxelCandidate> thrifty;
    PlateauTrial trial{.without{}, .seconds = trials_.plateauSeconds()};
    parallelInvoke([&] { thrifty = thriftyNear(bound); },
                   [&] {
                     if (!trials_.isPlateau()) return;
                     trial.with = addSeconds(trial.seconds, [&] { return withPlateau(bound); });
                   });
    if (thrifty && isSmaller(*thrifty, best)) best = std::move(*thrifty);
    if (!trials_.isPlateau()) return best;
    trial.without = std::move(best);
    return *std::move(trial).decide(isSmaller);
  }

  [[nodiscard]] std::optional<VoxelCandidate> thriftyNear(double bound) const {
    const double octave = trials_.octaveOf(bound) + kThriftOctaves;
    auto trial = trials_.coarsestFor(psnr_, octave, kPrice, kMaxThriftyTrials);
    return trial ? std::optional(stored(std::move(*trial))) : std::nullopt;
  }

  /// The smallest voxels found whose lattice has the value of the plateau.
  [[nodiscard]] std::optional<VoxelCandidate> withPlateau(double bound) const {
    const double levels = trials_.fewestLevels(psnr_, bound);
    if (levels == 0.0) return std::nullopt;
    std::optional<Trial> best;  // a higher price takes fewer bytes
    for (const double price : kPlateauPrices) {
      Trial trial = trials_.tryBound(trials_.boundOf(levels), price);
      if (trial.psnr < psnr_) break;
      best = std::move(trial);
    }
    return best ? std::optional(stored(std::move(*best))) : std::nullopt;
  }

  const Job& job_;
  VoxelTrials trials_;
  double psnr_;
};

}  // namespace

VoxelCandidate exactVoxels(const Job& job) {
  return timed([&] {
    return candidateOf(job, exactLayer(job.input.source), std::numeric_limits<double>::infinity());
  });
}

VoxelCandidate voxelsForPsnr(const Job& job, const PsnrTarget& target) {
  return timed([&] { return VoxelPsnrSearch(job, target.psnr).run(target.smallEnough); });
}

}  // namespace esvr::convert
