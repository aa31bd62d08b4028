#pragma once
/// A fit by the paper's method.

#include "esvr/fit.h"
#include "fit/target.h"

namespace esvr::paper {

/// \param target  of the volume, with a value that is not the background
[[nodiscard]] FitResult fitPaper(const SparseVolume& volume, const FitTarget& target,
                                 const FitOptions& options);

/// \throws UsageError  options that make no sense or contradict each other
void checkPaper(const FitOptions& options);

}  // namespace esvr::paper
