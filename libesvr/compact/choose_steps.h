#pragma once
/// Rate control: chooses the quantisation steps of the four parameter streams.

#include <cstdint>

#include "compact/trial.h"

namespace esvr {

/// Searches the smallest trial whose error does not exceed a limit. It measures the error that each
/// stream adds for a saved byte, changes the steps so that these costs become equal, and then
/// scales all steps together. If no trial keeps the limit, the result is the one of smallest error.
/// \param allowed  largest sum of squares over the box
[[nodiscard]] Trial chooseStepsWithin(TrialMaker& maker, double allowed);

/// Searches the trial of smallest error that takes at most `bytes`, in the same way. If no trial is
/// that small, the result is the smallest one.
[[nodiscard]] Trial chooseStepsFor(TrialMaker& maker, std::uint64_t bytes);

/// The trial with the steps with which these searches begin, and that with the first steps found that
/// keep to the bytes. With a quick maker, they take no evaluation of the ellipsoids.
[[nodiscard]] Trial firstStepsWithin(TrialMaker& maker, double allowed);
[[nodiscard]] Trial firstStepsFor(TrialMaker& maker, std::uint64_t bytes);

}  // namespace esvr
