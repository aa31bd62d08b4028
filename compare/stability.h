#pragma once
/// esvr-compare stability: compares the evaluation of a file's ellipsoids with their definition.

#include "compare/stability_options.h"

namespace esvr::compare {

/// Measures the grids of the file and prints figures and verdicts.
/// \throws TargetMissed  a grid differs by more than is allowed; the text lists every failure
/// \throws BadInput  the file is no .esvr file, or a grid or frame is missing
void stability(const StabilityRequest& request);

}  // namespace esvr::compare
