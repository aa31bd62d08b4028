#pragma once
/// Converts a sequence of files, one for each frame.

#include "esvr/workers.h"
#include "vdb2esvr/options.h"

namespace esvr::vdb2esvr {

/// Converts the frames, writes the report and prints the summary. Each frame is converted as a file
/// of its own: its output has the same bytes whatever other frames there are, and on any number of
/// threads.
/// \param ranks  must be null
/// \return 0
/// \throws Error  the kind of the first frame that failed; TargetMissed if frames missed the PSNR;
///                RuntimeFailure if the run was interrupted. All of them may be thrown after frames
///                were written
int runSequence(const Options& options, const Ranks* ranks);

}  // namespace esvr::vdb2esvr
