#pragma once
/// Converts a sequence of files, one for each frame.

#include "esvr/workers.h"
#include "vdb2esvr/options.h"

namespace esvr::vdb2esvr {

/// Frames of a group with an input each. A reader decodes at most one group to get at a frame, and
/// --resume loses at most the groups that were not complete. Groups of 24 frames would save 3 % of the
/// bytes of a fire, and one group 6 % (docs/lab-notes.md).
inline constexpr std::size_t kGroupFrames = 16;

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
