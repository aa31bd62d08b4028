#pragma once
/// The numbers that determine the memory of a fit.

#include <cstddef>
#include <cstdint>

#include "fit/target.h"

namespace esvr {

struct FitSize {
  std::size_t bricks = 0;
  std::uint64_t activeVoxels = 0;
  bool narrowBand = false;  ///< see FitOptions
  bool constants = false;   ///< the target has constants
};

[[nodiscard]] inline FitSize sizeOf(const FitTarget& target) {
  return {target.bricks.size(), target.activeVoxels, target.narrowBand, !target.constants.empty()};
}

}  // namespace esvr
