#pragma once
/// Errors of a fit from its residuals.

#include "fit/optimiser.h"
#include "fit/residual_field.h"

namespace esvr {

/// \param residual  the target's bricks first
[[nodiscard]] FitErrors errorsOf(const FitTarget& target, const ResidualField& residual);

}  // namespace esvr
