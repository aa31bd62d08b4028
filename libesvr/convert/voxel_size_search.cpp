#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "convert/octave_search.h"
#include "convert/unless_cancelled.h"
#include "convert/voxel_trials.h"
#include "esvr/grid_coding.h"
#include "format/voxel_section.h"

namespace esvr::convert {
namespace {

constexpr double kDoublingsPerOctave = 0.5;  // usual growth of the bytes by half the bound
constexpr double kSizeTolerance = 0.01;      // share of the bytes that may stay unused
/// Factor by which codes may exceed a size before the grid of a trial is not coded. While codes are
/// chosen, the coder's parameters are those of the nearest codes, which can take a few more bytes.
constexpr double kCodesBeyondSize = 1.1;

bool isCloser(const VoxelCandidate& a, const VoxelCandidate& b) { return a.psnr > b.psnr; }

/// Thrifty voxels of a bound.
struct SizedTrial {
  double octave = 0.0;
  std::uint64_t bytes = 0;                 ///< estimated if they are clearly larger than the size
  std::optional<VoxelCandidate> voxels{};  ///< nothing if they are larger than the size
};

/// The coarsest voxels that reach a PSNR, without and with the plateau, where they were tried.
struct CoarsestTrials {
  double psnr = 0.0;  ///< PSNR if every voxel has the code nearest to it, dB
  std::optional<SizedTrial> without{}, with{};

  /// True if voxels of the size do not reach the PSNR, because they are coarser.
  [[nodiscard]] bool areTooLarge() const {
    return without && !without->voxels && !(with && with->voxels);
  }
};

class VoxelSizeSearch {
 public:
  VoxelSizeSearch(const Job& job, std::uint64_t bytes)
      : job_(job), trials_(job), bytes_(bytes), besides_(bytesBesideVoxels(job.input)) {}

  /// \param least  PSNR that the voxels should have, dB
  VoxelsOfSize run(double least) const {
    if (!trials_.hasRange()) return {};
    CoarsestTrials coarsest = coarsestFor(least);
    VoxelsOfSize made;
    if (coarsest.areTooLarge()) {
      made.tooLarge = Candidate{coarsest.without->bytes, coarsest.psnr, true};
      made.plateau = {.tried = trials_.isPlateau(), .seconds = trials_.plateauSeconds()};
      return made;
    }
    made.found = best(std::move(coarsest));
    if (made.found) made.plateau = made.found->plateau;
    return made;
  }

 private:
  [[nodiscard]] CoarsestTrials coarsestFor(double psnr) const {
    if (job_.options.previous || !std::isfinite(psnr)) return {};
    auto plain = trials_.nearestFor(psnr);
    if (!plain) return {};
    const double bound = plain->bound;
    CoarsestTrials made{.psnr = plain->psnr, .without = tryCodes(bound, std::move(plain->layer))};
    if (!made.areTooLarge() || !trials_.isPlateau()) return made;
    const double levels = trials_.fewestLevels(psnr, bound);
    if (levels > 0.0) made.with = tryBound(trials_.boundOf(levels));
    return made;
  }

  [[nodiscard]] SizedTrial tryBound(double bound) const {
    return tryCodes(bound, trials_.nearestAt(bound));
  }

  /// Makes the nearest codes within a bound thrifty, and gives them up where they are clearly larger
  /// than the size.
  [[nodiscard]] SizedTrial tryCodes(double bound, VoxelLayer nearest) const {
    ThriftOptions thrift = trials_.thriftOf(kPrice);
    const std::uint64_t codes = bytes_ - std::min(bytes_, besides_);
    thrift.mostBytes = std::uint64_t(kCodesBeyondSize * double(codes));
    auto [layer, tooMany] = thriftyLayer(job_.input.source, std::move(nearest), thrift);
    SizedTrial trial{.octave = trials_.octaveOf(bound)};
    if (tooMany) {
      trial.bytes = *tooMany + besides_;
      return trial;
    }
    VoxelCandidate voxels = candidateOf(job_, std::move(layer), 0.0);
    trial.bytes = voxels.bytes;
    if (voxels.bytes > bytes_) return trial;
    voxels.psnr = psnrOf(job_, voxels.grid);
    trial.voxels = std::move(voxels);
    return trial;
  }

  /// The best voxels found without and with the plateau.
  /// \param first  trials that were already made
  [[nodiscard]] std::optional<VoxelCandidate> best(CoarsestTrials first) const {
    PlateauTrial trial{.without = fullest(false, std::move(first.without)),
                       .seconds = trials_.plateauSeconds()};
    if (trial.without) trial.without->plateau.seconds = trial.seconds;
    if (!trials_.isPlateau()) return std::move(trial.without);
    trial.with = addSeconds(trial.seconds, [&] {
      const auto tried = [&] { return fullest(true, std::move(first.with)); };
      return trial.without ? unlessCancelled(tried) : tried();
    });
    return std::move(trial).decide(isCloser);
  }

  /// The best voxels found that keep to the size. With plateaus, the largest are not always the
  /// best.
  [[nodiscard]] std::optional<VoxelCandidate> fullest(bool plateau,
                                                      std::optional<SizedTrial> known) const {
    const double aim = std::log2((1.0 - 0.3 * kSizeTolerance) * double(bytes_));
    const double bits = 8.0 * double(bytes_) / double(activeVoxelCount(job_.input.source));
    OctaveSearch search(aim, kDoublingsPerOctave, known ? known->octave : 2.0 + bits);
    std::optional<VoxelCandidate> best;
    for (int n = 0; n < kMaxTrials && !search.ended(); ++n) {
      double bound = trials_.boundAt(search.next());
      if (plateau) bound = trials_.boundOf(trials_.levelsOf(bound));
      auto now = unlessCancelled([&]() -> std::optional<SizedTrial> {
        return known ? std::exchange(known, std::nullopt) : tryBound(bound);
      });
      if (!now && best) break;
      if (!now) throw Cancelled();
      search.learn(std::log2(double(now->bytes)));
      if (!now->voxels) continue;
      const bool full = double(now->bytes) >= (1.0 - kSizeTolerance) * double(bytes_);
      if (!best || isCloser(*now->voxels, *best)) best = std::move(now->voxels);
      if (full) break;
    }
    return best;
  }

  const Job& job_;
  VoxelTrials trials_;
  std::uint64_t bytes_;    ///< The grid may add this many bytes to a file.
  std::uint64_t besides_;  ///< The grid adds this many of them without its voxels.
};

}  // namespace

std::uint64_t bytesBesideVoxels(const ConvertInput& input) {
  return bytesAdded(makeStoredVoxels(input.descriptor, input.source, {}));
}

std::optional<VoxelCandidate> exactVoxelsWithin(const Job& job, std::uint64_t bytes) {
  double seconds = 0.0;
  auto exact = addSeconds(seconds, [&]() -> std::optional<VoxelCandidate> {
    VoxelLayer layer = exactLayer(job.input.source);
    if (!job.options.previous && format::takeMore(layer, bytes)) return std::nullopt;
    auto made = candidateOf(job, std::move(layer), std::numeric_limits<double>::infinity());
    return made.bytes <= bytes ? std::optional(std::move(made)) : std::nullopt;
  });
  if (exact) exact->seconds = seconds;
  return exact;
}

VoxelsOfSize voxelsForSize(const Job& job, std::uint64_t bytes, double least) {
  VoxelsOfSize made = timed([&] { return VoxelSizeSearch(job, bytes).run(least); });
  if (made.found) made.found->seconds = made.seconds;
  return made;
}

}  // namespace esvr::convert
