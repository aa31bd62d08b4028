#pragma once
/// Counts bricks without listing them.

#include <span>

#include "field/support.h"

namespace esvr {

/// A bound on the number of bricks within a box that a support may touch.
[[nodiscard]] double maxBricks(const Support& support, const Box& within);

/// The number of bricks within a box that one support or more may touch. Stops, and returns what it
/// has, once there are more than `enough`.
[[nodiscard]] double countBricks(std::span<const Support> supports, const Box& within,
                                 double enough);

}  // namespace esvr
