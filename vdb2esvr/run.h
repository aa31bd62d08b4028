#pragma once
/// vdb2esvr's job.

#include "vdb2esvr/options.h"

namespace esvr::vdb2esvr {

/// Fits, writes, measures, tells. \return 0
/// \throws Error  as the parts do; TargetMissed and RuntimeFailure (interrupted) after the file was
///                written
int run(const Options& options);

}  // namespace esvr::vdb2esvr
