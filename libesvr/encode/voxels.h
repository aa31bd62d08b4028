#pragma once
/// The search for voxels that have a PSNR or a size: quantised voxels within a bound that is chosen, or
/// exact ones. Settings are tried on a sample of the bricks; the whole volume is coded once or twice.

#include <cstdint>
#include <optional>
#include <vector>

#include "encode/job.h"

namespace esvr::encode {

/// Factor by which an estimate of the bytes of voxels may be wrong. Within it, voxels are coded.
inline constexpr double kEstimateMargin = 1.2;
/// Bricks of the sample on which voxels of large volumes are tried, in runs of 64 neighbours.
inline constexpr std::size_t kBricksOfSample = 2048;

/// A grid that holds voxels.
struct VoxelCandidate {
  StoredGrid grid;
  std::uint64_t bytes = 0;  ///< bytes that it adds to the file or frame
  double psnr = 0.0;        ///< quality, dB; +inf if the voxels are exact
  double seconds = 0.0;     ///< wall-clock seconds of the whole search
};

/// The most frequent value of the active voxels besides 0 and the background, which are exact anyway,
/// and the share of voxels that have it.
struct Plateau {
  double value = 0.0, share = 0.0;
};

class VoxelSearch {
 public:
  /// The job must outlive the search.
  /// \param sampleBricks  bricks of the sample; volumes of less than four times as many are tried as a whole
  VoxelSearch(const Job& job, const Aim& goal, std::size_t sampleBricks = kBricksOfSample);
  VoxelSearch(const VoxelSearch&) = delete;
  VoxelSearch& operator=(const VoxelSearch&) = delete;

  /// The figures to expect of run(), from the sample. If the sample is the whole volume, they are those
  /// of the result, and Candidate::estimated is false.
  /// \param rival  bytes with which ellipsoids may reach the PSNR; where the voxels take many more, the result is the least
  ///               that they can take, and run() would search on. Nothing: it is not known
  /// \return nothing if no voxels can be that small
  [[nodiscard]] std::optional<Candidate> estimate(std::optional<double> rival = {});
  /// Whether its result is the least that voxels can take, which is many more bytes than the rival's.
  [[nodiscard]] bool areFarBehind() const { return isFarBehind_; }
  /// The bytes to expect of run(), which are more than the least ones.
  /// \param estimate  what estimate() has returned
  [[nodiscard]] std::uint64_t likelyBytes(const Candidate& estimate) const;

  /// For a size: the coarsest voxels with a PSNR if they are clearly too large, which takes less time to find out than
  /// estimate(); nothing if they may fit.
  [[nodiscard]] std::optional<Candidate> tooLargeFor(double psnr);

  /// The smallest voxels found that reach the PSNR, or the best ones that keep to the size. If the
  /// search is cancelled, the first ones that meet the goal.
  /// \return nothing if no voxels can be that small
  /// \throws Cancelled  no voxels were found before the cancellation
  [[nodiscard]] std::optional<VoxelCandidate> run();

  /// The wall-clock seconds of all that was done so far.
  [[nodiscard]] double seconds() const { return seconds_; }

 private:
  /// How voxels are quantised: the bound in octaves below the span of the values, the price of a bit
  /// (0: the nearest codes), and the number of lattice steps up to the plateau, which determines the
  /// bound (0: it does not).
  struct Setting {
    double octave = 0.0, price = 0.0, levels = 0.0;
  };
  /// A setting that was tried on the sample or on the volume.
  struct Tried {
    Setting setting;
    VoxelLayer layer;
    double psnr = 0.0;        ///< quality, dB; of a sample, that of the volume that it stands for
    std::uint64_t bytes = 0;  ///< as bytesOf(); 0 if they were not counted
  };

  [[nodiscard]] bool isSampled() const { return share_ < 1.0; }
  [[nodiscard]] double shareOf(const SparseVolume& volume) const;
  [[nodiscard]] bool hasPlateau() const;
  [[nodiscard]] double price() const;
  [[nodiscard]] double boundOf(const Setting& setting) const;
  [[nodiscard]] ThriftyLayer layerOf(const SparseVolume& volume, const Setting& setting,
                                     bool isSized = false) const;
  [[nodiscard]] double psnrOn(const SparseVolume& volume, const VoxelLayer& layer) const;
  [[nodiscard]] Tried tried(const SparseVolume& volume, const Setting& setting) const;
  [[nodiscard]] double shareOfBytes(const SparseVolume& volume, double bound) const;
  [[nodiscard]] std::uint64_t bytesOf(const SparseVolume& volume, VoxelLayer& layer,
                                      double bound) const;
  [[nodiscard]] std::optional<Tried> coarsest(const SparseVolume& volume, double psnr,
                                              const Setting& first, int mostTrials,
                                              double tolerance) const;
  [[nodiscard]] std::optional<Tried> fewestLevels(const SparseVolume& volume, const Setting& first,
                                                  int mostTrials, double tolerance) const;
  [[nodiscard]] double levelsOf(const Setting& setting) const;
  [[nodiscard]] std::optional<Tried> thriftyForPsnr(const Tried& plain) const;
  [[nodiscard]] std::optional<Tried> sized(const SparseVolume& volume,
                                           const Setting& setting) const;
  [[nodiscard]] std::optional<Tried> fullest(const SparseVolume& volume,
                                             const Setting& first) const;
  [[nodiscard]] VoxelCandidate candidateOf(Tried tried) const;
  [[nodiscard]] std::optional<VoxelCandidate> finished();

  [[nodiscard]] std::uint64_t exactBytes() const;
  void matchJudge();
  void trySettings();
  [[nodiscard]] bool exactIsBest();
  void tryForPsnr();
  void tryForSize();
  void considerPlateau(std::optional<Tried> with);

  const Job& job_;
  Aim goal_;
  std::size_t sampleBricks_;
  Box box_;
  double peak_ = 0.0;
  SparseVolume sample_;        ///< empty if the sample is the whole volume
  const SparseVolume& tryOn_;  ///< the sample, or the volume
  double share_ = 1.0;         ///< bricks of the sample per brick of the volume
  double mass_ = 0.0,
         sampleMass_ = 0.0;  ///< masses of the whole volume and of the sample, if kept
  double judged_ = 0.0;      ///< quality by the judge less the PSNR over the box, dB, for a sample
  double range_ = 0.0;       ///< span of the values; 0 for a volume of one value
  std::uint64_t besides_ = 0;  ///< bytes of a grid without its voxels
  Plateau plateau_;
  bool hasTried_ = false;
  /// Bytes with which ellipsoids may reach the PSNR, as estimate() was told.
  std::optional<double> rival_;
  /// The search ended because the voxels take many more bytes than the rival.
  bool isFarBehind_ = false;
  std::optional<Tried> best_;           ///< the best setting on the sample
  std::optional<std::uint64_t> exact_;  ///< bytes of exact voxels, if they may be the better ones
  double seconds_ = 0.0;
};

/// Exact voxels. Doubles are exact as they were read, rounded to float32.
[[nodiscard]] VoxelCandidate exactVoxels(const Job& job);

/// Exact voxels, if they take no more bytes than a grid of quantised ones, as they may where these are fine.
/// Where few bits for each voxel make that unlikely, nothing is coded.
[[nodiscard]] std::optional<VoxelCandidate> smallerExactVoxels(const Job& job,
                                                               const StoredGrid& quantised);

/// Estimates the bytes of a grid of exact voxels, for a large volume from a sample. The estimates of docs/lab-notes.md,
/// "Estimating the bytes of exact voxels", are 0.94 to 1.08 times the true bytes of volumes without
/// symmetry. A sample hardly contains mirror images and copies of bricks; with them, the estimate may be
/// nine times the true bytes.
[[nodiscard]] Candidate estimateExactVoxels(const Job& job,
                                            std::size_t sampleBricks = kBricksOfSample);

/// The numbers, increasing, of about so many of more bricks, in runs of 64 at equal distances. The bricks of a run follow
/// each other in the order in which voxels are coded, so that most of them are neighbours.
[[nodiscard]] std::vector<std::size_t> sampledBricks(const std::vector<Coord>& bricks,
                                                     std::size_t count);
/// These bricks of a volume at their positions; the whole volume if it has no more.
[[nodiscard]] SparseVolume sampleOf(const SparseVolume& volume, std::size_t bricks);

/// How voxels store the active mask of a grid: as StorageOptions say, but exactly for a level set,
/// because the width of its band is part of its shape.
[[nodiscard]] Activity voxelActivity(const Job& job);
/// How voxels are rounded: with their signs if the grid is a level set.
[[nodiscard]] RoundedSigns voxelSigns(const Job& job);
/// Whether a reader of the grid gets halfs, as for a source that was saved as half.
[[nodiscard]] DecodedValues decodedValues(const Job& job);

}  // namespace esvr::encode
