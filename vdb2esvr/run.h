#pragma once
/// The main function of vdb2esvr after its options are read.

#include "cli/log.h"
#include "esvr/progress.h"
#include "esvr/ranks.h"
#include "vdb2esvr/options.h"
#include "vdb2esvr/run_record.h"

namespace esvr::vdb2esvr {

/// False if the options exclude ellipsoids, so that no device is needed.
[[nodiscard]] bool mayFit(const Options& options);

/// Reads, fits and measures the grids of a file, and writes the output.
/// \param ranks  the processes that fit the parts together; may be null
/// \throws Error  any error of its parts; RuntimeFailure if it was cancelled and writes no file
[[nodiscard]] RunRecord convertFile(const Options& options, Ranks* ranks, const CancelToken& cancel,
                                    const cli::Log& log);

/// Reads, fits and measures the grids, writes the file and the report, and prints the summary.
/// \param ranks  the processes that fit the parts together; may be null
/// \return 0
/// \throws Error  any error of its parts; TargetMissed and RuntimeFailure (interrupted) may be
///                thrown after the file was written
int run(const Options& options, Ranks* ranks);

}  // namespace esvr::vdb2esvr
