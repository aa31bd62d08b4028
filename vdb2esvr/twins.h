#pragma once
/// Finds the grids of a file that have the same voxels as a grid before them.

#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "esvr/grid.h"
#include "vdb2esvr/choose_grids.h"
#include "vdb2esvr/options.h"

namespace esvr::vdb2esvr {

/// A grid whose conversion is that of an earlier grid, with a descriptor of its own.
struct Twin {
  std::size_t of = 0;  ///< index of the first grid with these voxels
  GridDescriptor descriptor;
  std::uint64_t nonFiniteReplaced = 0;
  InactiveValues inactive{};
  double secondsRead = 0.0;
};

/// The twins by their index in the list of grids.
using Twins = std::map<std::size_t, Twin>;

/// Reads the grids whose numbers and boxes of active voxels are the same, one after the other.
/// Twins have the same peak of the PSNR, the same range and the same goal. It ends early if the run is interrupted.
[[nodiscard]] Twins findTwins(const Options& options, const std::vector<FittedGrid>& grids);

}  // namespace esvr::vdb2esvr
