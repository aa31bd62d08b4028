#pragma once
/// esvr-compare check: compares a file with its reference and fails if it differs too much.

#include "compare/check_options.h"

namespace esvr::compare {

/// Compares the files and prints figures and differences.
/// \throws TargetMissed  a limit is missed; the text lists every failure
/// \throws BadInput  the files cannot be compared
void check(const CheckOptions& options);

}  // namespace esvr::compare
