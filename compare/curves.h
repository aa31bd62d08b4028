#pragma once
/// esvr-compare curves: error over run time, error over bytes, pictures per second over bytes.

#include "compare/curves_options.h"

namespace esvr::compare {

/// Measures the points and writes all files.
/// \throws BadInput  the files cannot be compared
/// \throws RuntimeFailure  the run was interrupted; finished points were written
void curves(const CurvesOptions& options);

}  // namespace esvr::compare
