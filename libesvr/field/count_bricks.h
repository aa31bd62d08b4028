#pragma once
/// Counts bricks without listing them.

#include <span>

#include "field/support.h"

namespace esvr {

/// An upper bound of the number of bricks in a box that a support may touch.
[[nodiscard]] double maxBricks(const Support& support, const Box& within);

/// The number of bricks in a box that at least one support may touch. The count stops once it is
/// above `enough`.
[[nodiscard]] double countBricks(std::span<const Support> supports, const Box& within,
                                 double enough);

/// \throws MemoryExceeded  the supports may reach more than 2^32 bricks of a box together, whose list
///                         would take 48 GiB
void requireListable(std::span<const Support> supports, const Box& within);

}  // namespace esvr
