#pragma once
/// The gate: is a file still what its reference says?

#include "compare/check_options.h"

namespace esvr::compare {

/// Prints the figures and differences. \throws TargetMissed  a limit, with every failure in its
/// text; BadInput: what cannot be compared
void check(const CheckOptions& options);

}  // namespace esvr::compare
