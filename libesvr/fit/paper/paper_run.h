#pragma once
/// The paper's algorithm: epochs, densification and pruning (appendix, 'Structure-aware ellipsoid
/// learning').

#include "esvr/paper_method.h"
#include "fit/paper/paper_optimiser.h"
#include "fit/recorder.h"

namespace esvr::paper {

/// The input of a run.
struct PaperRun {
  const FitTarget& target;
  const PaperMethod& method;
  const CommonFitOptions& options;  ///< the seed, psnr and seconds are used
};

[[nodiscard]] KernelKind kindOf(const PaperMethod& method);

/// Places the seeds and runs all epochs.
/// \param record  output: the outcome of the run
FitEnd runPaper(PaperOptimiser& optimiser, const PaperRun& run, Recorder& recorder,
                PaperRecord& record);

}  // namespace esvr::paper
