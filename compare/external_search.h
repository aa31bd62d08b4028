#pragma once
/// Searches the bound of an external command for a size or a PSNR.

#include <cstdint>
#include <vector>

#include "compare/external_command.h"
#include "esvr/baseline.h"

namespace esvr::compare {

/// One trial of a search.
struct ExternalStep {
  double bound = 0.0;
  std::uint64_t bytes = 0;
  double psnr = 0.0;  ///< dB over the voxels of the search; NaN if it did not need it
};

struct ExternalMatch {
  bool found = false;
  ExternalStep best;
  std::vector<ExternalStep> steps;  ///< all trials, in order
};

/// Searches the bound with the highest PSNR that takes at most `bytes`. Bounds fall from the peak
/// in steps of 10 until a file is too large, and the last step is bisected until a file is at most
/// 2 % smaller than the size.
[[nodiscard]] ExternalMatch matchSize(ExternalCodec& codec, std::uint64_t bytes);

/// Searches the bound with the fewest bytes that reaches a PSNR, in the same way; the bisection
/// ends at a file that exceeds the PSNR by at most 0.05 dB.
/// MatchGoal::dropsVoxels has no meaning here.
[[nodiscard]] ExternalMatch matchPsnr(ExternalCodec& codec, const MatchGoal& goal);

}  // namespace esvr::compare
