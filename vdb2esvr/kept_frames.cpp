#include "vdb2esvr/kept_frames.h"

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <set>
#include <sstream>
#include <string>
#include <system_error>

#include "esvr/error.h"
#include "vdb2esvr/run.h"

namespace esvr::vdb2esvr {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const std::string& why) {
  throw UsageError("the partial file " + why +
                   "; --resume continues a run with the same options only");
}

/// The planned group of each frame, by the number of the frame.
std::map<cli::FrameNumber, std::size_t> groupsByNumber(const std::vector<cli::Frame>& frames,
                                                       const std::vector<PlannedGroup>& planned) {
  std::map<cli::FrameNumber, std::size_t> groups;
  for (std::size_t g = 0; g < planned.size(); ++g)
    for (const std::size_t frame : planned[g]) groups[frames[frame].number] = g;
  return groups;
}

bool hasAll(const std::vector<cli::Frame>& frames, const PlannedGroup& group,
            const std::set<cli::FrameNumber>& stored) {
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
  std::set<cli::FrameNumber> numbers;
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

// The inputs.

bool isOlder(const fs::path& output, const fs::path& madeOf) {
  std::error_code unreadable;
  const auto made = fs::last_write_time(output, unreadable);
  if (unreadable) return false;
  const auto changed = fs::last_write_time(madeOf, unreadable);
  return !unreadable && changed > made;
}

InputState stateOf(const cli::Frame& frame) {
  if (frame.holds) return {};
  std::error_code unreadable;  // who reads the file says why
  const std::uint64_t bytes = fs::file_size(frame.input, unreadable);
  const auto changed = fs::last_write_time(frame.input, unreadable).time_since_epoch().count();
  return unreadable ? InputState{} : InputState{bytes, std::int64_t(changed)};
}

fs::path FrameInputs::pathFor(const fs::path& partial) { return partial.string() + ".inputs"; }

FrameInputs::FrameInputs(const fs::path& partial, bool continues) : path_(pathFor(partial)) {
  if (!continues) {
    remove();
    return;
  }
  std::ifstream file(path_);
  // A frame that was converted twice has two lines, and the last line may not be complete.
  for (std::string line; std::getline(file, line) && !file.eof();) {
    std::istringstream words(line);
    cli::FrameNumber number = 0;
    InputState state;
    if (words >> number >> state.bytes >> state.changed) states_[number] = state;
  }
}

bool FrameInputs::haveThatOf(const cli::Frame& frame) const {
  const auto at = states_.find(frame.number);
  return at != states_.end() && at->second == stateOf(frame);
}

void FrameInputs::add(const cli::Frame& frame, const InputState& state) {
  std::ofstream file(path_, std::ios::app);
  file << frame.number << ' ' << state.bytes << ' ' << state.changed << '\n' << std::flush;
  if (!file)
    throw RuntimeFailure("cannot write " + path_.string() + ": " +
                         std::generic_category().message(errno));
}

void FrameInputs::remove() {
  std::error_code ignored;
  fs::remove(path_, ignored);
}

std::optional<cli::Frame> keepUnchanged(const FrameInputs& inputs,
                                        const std::vector<cli::Frame>& frames,
                                        const std::vector<PlannedGroup>& planned,
                                        const std::vector<SequenceFrame>& stored,
                                        KeptGroups& kept) {
  const auto plannedOf = groupsByNumber(frames, planned);
  const auto groupOf = [&](const SequenceFrame& frame) { return plannedOf.at(frame.number); };
  for (const SequenceFrame& frame : stored) {
    if (frame.group >= kept.stored) break;
    const auto& now = *std::ranges::find(frames, frame.number, &cli::Frame::number);
    if (inputs.haveThatOf(now)) continue;
    const auto first = std::ranges::find(stored, groupOf(frame), groupOf);
    kept = {groupOf(frame), first->group};
    return now;
  }
  return std::nullopt;
}

}  // namespace esvr::vdb2esvr
