#pragma once
/// What a fit derives from its options, in one chunk or in several.

#include <span>

#include "esvr/fit.h"
#include "fit/ellipsoid.h"
#include "fit/target.h"
#include "fit/tuning.h"

namespace esvr {

/// \throws UsageError  an option is out of range
void checkOptions(const FitOptions& options);

/// Sets the members of a target that follow from options.
void applyOptions(const FitOptions& options, FitTarget& target);

/// The kappa with which a fit begins.
[[nodiscard]] float firstKappa(const FitOptions& options, const Tuning& tuning);

/// The range of a volume's values, to which sums are clamped.
[[nodiscard]] ValueRange rangeOf(float background, const TargetScale& scale);

[[nodiscard]] bool anyNegative(std::span<const Ellipsoid> ellipsoids);

}  // namespace esvr
