#include "vdb2esvr/sequence_summary.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <ostream>

#include "cli/printable.h"
#include "cli/table.h"

namespace esvr::vdb2esvr {
namespace {

std::string stateOf(const SequenceRecord& record, const FrameRecord& frame) {
  if (frame.state != FrameState::kHeld) return nameOf(frame.state);
  return "held from " + std::to_string(record.frames[*frame.frame.holds].frame.number);
}

/// The smallest value of the grids of a frame as text.
std::string lowest(const FrameRecord& frame, double FrameGrid::*psnr) {
  double least = std::numeric_limits<double>::infinity();
  for (const FrameGrid& grid : frame.grids) least = std::min(least, grid.*psnr);
  return cli::decibels(least);
}

std::vector<std::string> rowOf(const SequenceRecord& record, const FrameRecord& frame) {
  const std::string number = std::to_string(frame.frame.number);
  const std::string state = stateOf(record, frame);
  if (frame.grids.empty()) return {number, "-", "-", "-", "-", "-", "-", state};
  std::size_t ellipsoids = 0;
  for (const FrameGrid& grid : frame.grids) ellipsoids += grid.ellipsoids;
  return {number,
          std::to_string(frame.grids.size()),
          std::to_string(ellipsoids),
          std::to_string(frame.bytesOut),
          lowest(frame, &FrameGrid::psnrBox),
          lowest(frame, &FrameGrid::psnrActive),
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

void printBytes(const Options& options, const SequenceRecord& record, std::ostream& out) {
  std::uint64_t bytesIn = 0, bytesOut = 0;
  for (const FrameRecord& frame : record.frames)
    bytesIn += frame.bytesIn, bytesOut += frame.grids.empty() ? 0 : frame.bytesOut;
  if (bytesOut == 0) return;
  out << cli::printable(options.input.string()) << ' ' << bytesIn << " bytes -> "
      << cli::printable(options.output.string()) << ' ' << bytesOut
      << " bytes, 1 : " << cli::shortNumber(double(bytesIn) / double(bytesOut)) << '\n';
}

}  // namespace

void printSequence(const Options& options, const SequenceRecord& record, std::ostream& out) {
  cli::Table table(
      {"frame", "grids", "ellipsoids", "bytes", "PSNR box", "active", "seconds", "state"});
  for (const FrameRecord& frame : record.frames) table.add(rowOf(record, frame));
  table.print(out);
  printRanges(record, out);
  printBytes(options, record, out);
}

}  // namespace esvr::vdb2esvr
