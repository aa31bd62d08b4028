#pragma once
/// The main function of vdb2esvr after its options are read.

#include "esvr/ranks.h"
#include "vdb2esvr/options.h"

namespace esvr::vdb2esvr {

/// Reads, fits and measures the grids, writes the file and the report, and prints the summary.
/// \param ranks  the processes that fit the parts together; may be null
/// \return 0
/// \throws Error  any error of its parts; TargetMissed and RuntimeFailure (interrupted) may be
///                thrown after the file was written
int run(const Options& options, Ranks* ranks);

}  // namespace esvr::vdb2esvr
