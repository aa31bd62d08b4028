#pragma once
/// Errors of a fit from its residuals.

#include "fit/optimiser.h"
#include "fit/residual_field.h"

namespace esvr {

/// \param residual  residuals whose first bricks are the target's
[[nodiscard]] FitErrors errorsOf(const FitTarget& target, const ResidualField& residual);

}  // namespace esvr
