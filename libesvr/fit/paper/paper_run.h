#pragma once
/// Epochs, densification and pruning: the paper's algorithm (appendix, 'Structure-aware ellipsoid
/// learning').

#include "esvr/paper_method.h"
#include "fit/paper/paper_optimiser.h"
#include "fit/recorder.h"

namespace esvr::paper {

/// What a run is given.
struct PaperRun {
  const FitTarget& target;
  const PaperMethod& method;
  const CommonFitOptions& options;  ///< seed, and psnr and seconds, at which it ends too
};

[[nodiscard]] KernelKind kindOf(const PaperMethod& method);

/// Places the points and goes through the epochs.
/// \param record  out: what was done
FitEnd runPaper(PaperOptimiser& optimiser, const PaperRun& run, Recorder& recorder,
                PaperRecord& record);

}  // namespace esvr::paper
