#pragma once
/// Divides the frames of a sequence into the groups of one file.

#include <cstddef>
#include <vector>

#include "esvr/sequence_file.h"
#include "programs/sequence.h"

namespace esvr::vdb2esvr {

/// Frames of a group with an input each. A reader decodes at most one group to get at a frame, and
/// --resume loses at most the groups that were not complete. Groups of 24 frames would save 3 % of the
/// bytes of a fire, and one group 6 % (docs/lab-notes.md).
inline constexpr std::size_t kGroupFrames = 16;

/// The indices of the frames of a group.
using PlannedGroup = std::vector<std::size_t>;

/// Divides frames with increasing numbers into groups of kGroupFrames; the last one may have fewer. A
/// frame that holds another one is in the group of that frame. Frames that
/// are left out are in no group.
[[nodiscard]] std::vector<PlannedGroup> planGroups(const std::vector<cli::Frame>& frames);

/// What a run that continues another one keeps of its partial file.
struct KeptGroups {
  std::size_t planned = 0;  ///< number of planned groups that are complete
  std::size_t stored = 0;   ///< number of groups of the partial file that hold them
};

/// Finds the planned groups that a partial file has completely. A planned group may be several
/// groups of the file. It may lack frames that could not be converted, if the file has frames of a
/// later group.
/// \param stored  the frames of the partial file
/// \throws UsageError  the partial file has frames or groups that are not planned
[[nodiscard]] KeptGroups keptGroups(const std::vector<cli::Frame>& frames,
                                    const std::vector<PlannedGroup>& planned,
                                    const std::vector<SequenceFrame>& stored);

}  // namespace esvr::vdb2esvr
