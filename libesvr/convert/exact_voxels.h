#pragma once
/// Exact voxels as an alternative to ellipsoids: no file needs to be larger than theirs.

#include <optional>
#include <utility>

#include "convert/voxel_search.h"

namespace esvr::convert {

/// True for volumes of more than VoxelLimits::maxVoxels.
[[nodiscard]] bool isLarge(const Job& job);

/// Estimates the bytes of a grid of exact voxels from a sample. If the runs have 16 bricks, the
/// estimates of docs/lab-notes.md, "Estimating the bytes of exact voxels", are 0.94 to 1.08 times
/// the true bytes of volumes without symmetry. A sample hardly contains mirror images and copies of
/// bricks; with them, the estimate may be nine times the true bytes.
[[nodiscard]] Candidate estimateExactVoxels(const ConvertInput& input, const SampleSize& size);

/// The exact voxels of a job. Those of a large volume are coded only if an estimate says that they
/// may be small enough.
class ExactVoxels {
 public:
  explicit ExactVoxels(const Job& job);

  /// Uses voxels that another thread has coded.
  void set(VoxelCandidate coded) { coded_ = std::move(coded); }

  /// True if the voxels add at most `bytes` to a file. They are coded unless their estimate is much
  /// larger.
  [[nodiscard]] bool takeAtMost(double bytes);

  /// Bytes, PSNR and seconds of the coded voxels, or of the estimate if none were coded. Those of a
  /// volume that is not large are known after takeAtMost() only.
  [[nodiscard]] Candidate figures() const;

  /// The voxels, which are coded if they were not before.
  [[nodiscard]] VoxelCandidate take() &&;

 private:
  const VoxelCandidate& coded();

  const Job& job_;
  std::optional<Candidate> estimate_;  ///< set for a large volume
  std::optional<VoxelCandidate> coded_;
};

}  // namespace esvr::convert
