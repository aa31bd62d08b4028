#pragma once
/// Trials of the searches for voxels: a volume quantised within a bound.

#include <cmath>
#include <cstdint>
#include <optional>

#include "convert/voxel_search.h"
#include "core/add_seconds.h"
#include "esvr/quantised.h"

namespace esvr::convert {

/// Largest number of trials of a search.
inline constexpr int kMaxTrials = 14;

/// Price of a bit (thriftyLayer). It is the best one at 40 to 60 dB on the volumes of
/// docs/lab-notes.md, "Voxel coding": 0.05 gives files that are up to 1 % larger, 0.12 up to 5 %.
inline constexpr double kPrice = 0.08;

/// The most frequent value of the active voxels besides 0 and the background, which are exact
/// anyway, the share of voxels that have it, and the seconds that counting them took.
struct Plateau {
  double value = 0.0, share = 0.0, seconds = 0.0;
};

/// A layer, its bound and its PSNR.
struct Trial {
  double bound, psnr;
  VoxelLayer layer;
};

/// Voxels on a lattice without and with the plateau, and the seconds that the latter took.
struct PlateauTrial {
  std::optional<VoxelCandidate> without, with{};
  double seconds = 0.0;

  /// The better ones, with a record of the decision.
  template <class Better>
  std::optional<VoxelCandidate> decide(const Better& better) && {
    Decision decision{.tried = true, .seconds = seconds};
    if (without) decision.bytesWithout = without->bytes;
    if (with) decision.bytesWith = with->bytes;
    decision.used = with && (!without || better(*with, *without));
    auto& best = decision.used ? with : without;
    if (best) best->plateau = decision;
    return std::move(best);
  }
};

/// The result of `make`, whose member `seconds` says how long making it took.
template <class Make>
auto timed(const Make& make) {
  double seconds = 0.0;
  auto made = addSeconds(seconds, make);
  made.seconds = seconds;
  return made;
}

/// A layer as a grid of the job.
/// \param psnr  its PSNR over the box, dB
[[nodiscard]] VoxelCandidate candidateOf(const Job& job, VoxelLayer layer, double psnr);

/// Quantises the volume of a job. Bounds are counted in octaves below the span of its values
/// (octave_search.h, spanOf). The job must outlive the object.
class VoxelTrials {
 public:
  explicit VoxelTrials(const Job& job);

  /// False for a volume of one value, which has no bounds.
  [[nodiscard]] bool hasRange() const { return range_ > 0.0; }
  [[nodiscard]] double boundAt(double octave) const { return range_ * std::exp2(-octave); }
  [[nodiscard]] double octaveOf(double bound) const { return std::log2(range_ / bound); }

  /// True if the plateau is frequent enough that a lattice that contains it, so that its voxels are
  /// exact, should be tried.
  [[nodiscard]] bool isPlateau() const;
  /// The seconds that counting the voxels of the plateau took.
  [[nodiscard]] double plateauSeconds() const { return plateau_.seconds; }
  /// The bound of a lattice that has `levels` steps from 0 to the plateau.
  [[nodiscard]] double boundOf(double levels) const { return 0.5 * plateau_.value / levels; }
  [[nodiscard]] double levelsOf(double bound) const;

  /// The nearest codes within a bound.
  [[nodiscard]] VoxelLayer nearestAt(double bound) const;
  [[nodiscard]] ThriftOptions thriftOf(double price) const;

  /// Thrifty voxels, or the nearest codes for a price of 0.
  [[nodiscard]] Trial tryBound(double bound, double price) const;

  /// The coarsest trial found that reaches a PSNR (dB over the box); nothing if none does.
  [[nodiscard]] std::optional<Trial> coarsestFor(double psnr, double firstOctave, double price,
                                                 int maxTrials) const;

  /// The same for the nearest codes.
  [[nodiscard]] std::optional<Trial> nearestFor(double psnr) const;

  /// The smallest number of levels found with which a lattice that has the plateau reaches a PSNR, near
  /// a bound that reaches it; 0 if there is none. It is found by bisection, although the PSNR need not
  /// be monotone in the number of levels where there are other plateaus.
  [[nodiscard]] double fewestLevels(double psnr, double bound) const;

  /// The number of trials that may be in memory at once.
  [[nodiscard]] int trialsAtOnce() const;

 private:
  const Job& job_;
  Plateau plateau_;
  double range_ = 0.0;
};

}  // namespace esvr::convert
