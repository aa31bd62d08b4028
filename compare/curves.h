#pragma once
/// Error over run time, error over bytes, pictures a second over bytes.

#include "compare/curves_options.h"

namespace esvr::compare {

/// \throws BadInput  what cannot be compared; RuntimeFailure: interrupted, with the points already
/// made written
void curves(const CurvesOptions& options);

}  // namespace esvr::compare
