#pragma once
/// Which parameter gets how many bits.

#include <cstdint>

#include "compact/trial.h"

namespace esvr {

/// The smallest of the trials that stay within an error: what a bit of each stream costs and brings
/// is measured and made equal, then all steps are scaled together. Where no trial stays within the
/// error, the one with the smallest error.
/// \param allowed  sum of squares over the box
[[nodiscard]] Trial chooseStepsWithin(TrialMaker& maker, double allowed);

/// The other way round: the smallest error of the trials of at most so many bytes; where none is,
/// the smallest.
[[nodiscard]] Trial chooseStepsFor(TrialMaker& maker, std::uint64_t bytes);

}  // namespace esvr
