#pragma once
/// The searches for the voxels that serve a goal: quantised voxels within a bound that is chosen.
/// No fit is made.

#include <cstdint>
#include <optional>

#include "convert/attempt.h"

namespace esvr::convert {

/// A grid that holds voxels.
struct VoxelCandidate {
  StoredGrid grid;
  std::uint64_t bytes = 0;  ///< bytesAdded
  double psnr = 0.0;        ///< dB over the box; +inf if the voxels are exact
  double seconds = 0.0;     ///< wall-clock seconds of the whole search
  Decision plateau;         ///< whether the lattice contains the most frequent value
};

/// Exact voxels. Doubles are exact as they were read, rounded to float32.
[[nodiscard]] VoxelCandidate exactVoxels(const Job& job);

/// The voxels with the widest quantisation found whose PSNR is at least `psnr`; exact voxels if
/// quantised ones do not reach it.
[[nodiscard]] VoxelCandidate voxelsForPsnr(const Job& job, const PsnrTarget& target);

/// The best voxels found that add at most `bytes` to a file.
/// \return nothing if even the coarsest voxels are larger
[[nodiscard]] std::optional<VoxelCandidate> voxelsForSize(const Job& job, std::uint64_t bytes);

}  // namespace esvr::convert
