#include "vdb2esvr/sequence_summary.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <ostream>
#include <utility>

#include "cli/printable.h"
#include "cli/table.h"
#include "vdb2esvr/group_plan.h"

namespace esvr::vdb2esvr {
namespace {

std::string stateOf(const SequenceRecord& record, const FrameRecord& frame) {
  if (frame.state != FrameState::kHeld) return nameOf(frame.state);
  return "held from " + std::to_string(record.frames[*frame.frame.holds].frame.number);
}

/// True for a frame that this run converted, which may have no grid.
bool hasFigures(const FrameRecord& frame) { return frame.bytesIn > 0; }

/// The smallest value of the fitted grids of a frame as text.
std::string lowest(const FrameRecord& frame, double FrameGrid::*psnr) {
  if (frame.grids.empty()) return "-";
  double least = std::numeric_limits<double>::infinity();
  for (const FrameGrid& grid : frame.grids) least = std::min(least, grid.*psnr);
  return cli::decibels(least);
}

std::vector<std::string> rowOf(const SequenceRecord& record, const FrameRecord& frame) {
  const std::string number = std::to_string(frame.frame.number);
  const std::string state = stateOf(record, frame);
  if (!hasFigures(frame)) return {number, "-", "-", "-", "-", "-", "-", "-", state};
  std::size_t ellipsoids = 0;
  for (const FrameGrid& grid : frame.grids) ellipsoids += grid.ellipsoids;
  return {number,
          std::to_string(frame.grids.size()),
          std::to_string(frame.carried.size()),
          std::to_string(ellipsoids),
          std::to_string(frame.bytesOut),
          lowest(frame, &FrameGrid::psnrActive),
          lowest(frame, &FrameGrid::psnrBox),
          cli::seconds(frame.seconds),
          state};
}

/// "40.01 to 40.04 dB", or "exact".
std::string rangeText(const GridRange& range) {
  const std::string low = cli::decibels(range.lowestActive);
  const std::string high = cli::decibels(range.highestActive);
  if (std::isinf(range.lowestActive)) return low;
  return (low == high ? low : low + " to " + high) + " dB";
}

void printRanges(const SequenceRecord& record, std::ostream& out) {
  for (const GridRange& range : gridRanges(record))
    out << cli::printable(range.name) << ": " << rangeText(range) << " over the active voxels of "
        << range.frames << (range.frames == 1 ? " frame\n" : " frames\n");
}

/// Says what became of grids that were not fitted, each once with the number of its frames.
void printNotFittedIn(const SequenceRecord& record, std::vector<NotFittedName> FrameRecord::*grids,
                      const char* what, std::ostream& out) {
  std::map<std::pair<std::string, std::string>, std::size_t> counts;
  for (const FrameRecord& frame : record.frames)
    for (const NotFittedName& grid : frame.*grids) ++counts[{grid.name, grid.why}];
  for (const auto& [grid, frames] : counts)
    out << cli::printable(grid.first) << ": " << what << " in " << frames
        << (frames == 1 ? " frame" : " frames") << ", because " << cli::printable(grid.second)
        << '\n';
}

/// Says how the frames are divided into the groups of one file.
void printGroups(const Options& options, const SequenceRecord& record, std::ostream& out) {
  if (!record.file) return;
  std::vector<cli::FrameNumber> differing;
  for (const FrameRecord& frame : record.frames)
    if (frame.gridsDiffer) differing.push_back(frame.frame.number);
  out << cli::printable(options.output.string()) << ": " << record.file->groups
      << (record.file->groups == 1 ? " group" : " groups") << " of at most " << kGroupFrames
      << " frames\n";
  if (!differing.empty())
    out << (differing.size() == 1 ? "frame " : "frames ") << cli::textOfFrames(differing)
        << (differing.size() == 1 ? " begins a group, because its"
                                  : " each begin a group, because their")
        << " grids differ from those of the frame before\n";
}

/// The bytes of the output of the frames that this run converted.
std::uint64_t bytesOutOf(const SequenceRecord& record) {
  if (record.file) return record.file->bytes.value_or(0);
  std::uint64_t bytes = 0;
  for (const FrameRecord& frame : record.frames) bytes += hasFigures(frame) ? frame.bytesOut : 0;
  return bytes;
}

void printBytes(const Options& options, const SequenceRecord& record, std::ostream& out) {
  std::uint64_t bytesIn = 0;
  for (const FrameRecord& frame : record.frames) bytesIn += frame.bytesIn;
  const std::uint64_t bytesOut = bytesOutOf(record);
  const bool hasKept = !framesIn(FrameState::kKept, record).empty();
  // The file has the frames of an earlier run, too, whose input this run did not read.
  if (bytesOut == 0 || (record.file && hasKept)) return;
  out << cli::printable(options.input.string()) << ' ' << bytesIn << " bytes -> "
      << cli::printable(options.output.string()) << ' ' << bytesOut
      << " bytes, 1 : " << cli::shortNumber(double(bytesIn) / double(bytesOut)) << '\n';
}

}  // namespace

void printSequence(const Options& options, const SequenceRecord& record, std::ostream& out) {
  cli::Table table({"frame", "fitted", "carried", "ellipsoids", "bytes", "PSNR active", "PSNR box",
                    "seconds", "state"});
  for (const FrameRecord& frame : record.frames) table.add(rowOf(record, frame));
  table.print(out);
  printRanges(record, out);
  printNotFittedIn(record, &FrameRecord::carried, "carried unchanged", out);
  printNotFittedIn(record, &FrameRecord::skipped, "left out", out);
  printGroups(options, record, out);
  printBytes(options, record, out);
}

}  // namespace esvr::vdb2esvr
