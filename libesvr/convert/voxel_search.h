#pragma once
/// The searches for the voxels that serve a goal: quantised voxels within a bound that is chosen.
/// No fit is made.

#include <cstdint>
#include <limits>
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

/// Bytes that a grid of voxels adds to a file besides those of its voxels.
[[nodiscard]] std::uint64_t bytesBesideVoxels(const ConvertInput& input);

/// Exact voxels. Doubles are exact as they were read, rounded to float32.
[[nodiscard]] VoxelCandidate exactVoxels(const Job& job);

/// The voxels with the widest quantisation found whose PSNR is at least `psnr`; exact voxels if
/// quantised ones do not reach it.
[[nodiscard]] VoxelCandidate voxelsForPsnr(const Job& job, const PsnrTarget& target);

/// Exact voxels that add at most `bytes` to a file.
/// \return nothing if they are larger, which usually shows before all of them are coded
[[nodiscard]] std::optional<VoxelCandidate> exactVoxelsWithin(const Job& job, std::uint64_t bytes);

/// What a search for voxels of a size found.
struct VoxelsOfSize {
  std::optional<VoxelCandidate> found;  ///< nothing if even the coarsest voxels are larger
  /// Set if no voxels of the size have the wanted PSNR: the coarsest voxels that have it, with
  /// estimated bytes. Nothing was found then.
  std::optional<Candidate> tooLarge;
  Decision plateau;      ///< whether the lattice contains the most frequent value
  double seconds = 0.0;  ///< wall-clock seconds of the whole search
};

/// The best quantised voxels found that add at most `bytes` to a file.
/// \param least  PSNR over the box, dB, below which voxels are of no use. The coarsest voxels with
///               this PSNR are tried first. If they are larger than `bytes`, the search ends: smaller
///               voxels are coarser, and their PSNR is below `least`
[[nodiscard]] VoxelsOfSize voxelsForSize(const Job& job, std::uint64_t bytes,
                                         double least = -std::numeric_limits<double>::infinity());

}  // namespace esvr::convert
