#include "vdb2esvr/group_plan.h"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "esvr/error.h"

namespace esvr::vdb2esvr {
namespace {

using cli::FrameNumber;

[[noreturn]] void refuse(const std::string& why) {
  throw UsageError("the partial file " + why +
                   "; --resume continues a run with the same options only");
}

/// The planned group of each frame, by the number of the frame.
std::map<FrameNumber, std::size_t> groupsByNumber(const std::vector<cli::Frame>& frames,
                                                  const std::vector<PlannedGroup>& planned) {
  std::map<FrameNumber, std::size_t> groups;
  for (std::size_t g = 0; g < planned.size(); ++g)
    for (const std::size_t frame : planned[g]) groups[frames[frame].number] = g;
  return groups;
}

bool hasAll(const std::vector<cli::Frame>& frames, const PlannedGroup& group,
            const std::set<FrameNumber>& stored) {
  return std::ranges::all_of(
      group, [&](std::size_t frame) { return stored.contains(frames[frame].number); });
}

}  // namespace

std::vector<PlannedGroup> planGroups(const std::vector<cli::Frame>& frames) {
  std::vector<PlannedGroup> groups;
  std::size_t withInput =
      kGroupFrames;  // frames with an input in the last group; no frame is held by it
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (frames[i].missing && !frames[i].holds) continue;
    if (!frames[i].holds && withInput++ == kGroupFrames) groups.emplace_back(), withInput = 1;
    groups.back().push_back(i);
  }
  return groups;
}

KeptGroups keptGroups(const std::vector<cli::Frame>& frames,
                      const std::vector<PlannedGroup>& planned,
                      const std::vector<SequenceFrame>& stored) {
  if (stored.empty()) return {};
  const auto groups = groupsByNumber(frames, planned);
  std::set<FrameNumber> numbers;
  std::optional<std::size_t> last;  // planned group of the frame before
  KeptGroups kept;
  for (const SequenceFrame& frame : stored) {
    const auto group = groups.find(frame.number);
    if (group == groups.end()) refuse("has frame " + std::to_string(frame.number));
    const bool beginsStored = numbers.empty() || frame.group != stored[numbers.size() - 1].group;
    if (last && *last != group->second && !beginsStored) refuse("has other groups");
    if (last != group->second) kept = {group->second, frame.group};
    last = group->second;
    numbers.insert(frame.number);
  }
  if (hasAll(frames, planned[*last], numbers)) kept = {*last + 1, stored.back().group + 1};
  return kept;
}

}  // namespace esvr::vdb2esvr
