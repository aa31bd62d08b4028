// The records of a run and of a sequence, from which their summaries and reports are made.
#include "vdb2esvr/records.h"

#include <algorithm>
#include <set>
#include <unordered_map>

#include "programs/option_values.h"
#include "programs/run_main.h"

namespace esvr::vdb2esvr {

// A run.

std::uint64_t bytesOf(const EsvrSummary& file, std::size_t grid, const std::string& kind) {
  return cli::bytesIf(file,
                      [&](const SectionSummary& s) { return s.grid == grid && s.kind == kind; });
}

std::size_t numberOfCarried(const RunRecord& record, std::size_t carried) {
  return record.grids.size() + carried;
}

std::uint64_t ownBytes(const EsvrSummary& file, const ConvertedVector& vector) {
  std::uint64_t bytes = 0;
  for (std::size_t c = 0; c < kComponents; ++c)
    bytes += cli::ownBytes(file, vector.stored.first + c);
  return bytes;
}

Ratio ratioOf(const RunRecord& record) {
  const std::size_t converted = record.grids.size() - record.vectors.size() * (kComponents - 1);
  Ratio ratio{0, record.output.fileBytes, converted + record.carried.size(),
              record.input.grids.size()};
  if (ratio.wholeInput() || record.isOfSplats) {
    ratio.bytesIn = record.input.fileBytes;
    return ratio;
  }
  std::set<std::size_t> places;  // components share the place of their grid
  for (const ConvertedGrid& grid : record.grids) places.insert(grid.id.place);
  for (const std::size_t place : places) ratio.bytesIn += record.input.grids[place].storedBytes;
  for (const NotFitted& carried : record.carried) ratio.bytesIn += carried.grid.storedBytes;
  return ratio;
}

const ConvertedGrid* firstBelow(const RunRecord& record) {
  const auto below = std::ranges::find_if(record.grids, [](const ConvertedGrid& grid) {
    return grid.wantedPsnr && !(grid.metrics.psnrBox >= *grid.wantedPsnr);
  });
  return below == record.grids.end() ? nullptr : &*below;
}

int exitCodeOf(const RunRecord& record) {
  if (record.interrupted) return int(ErrorKind::kRuntime);
  return firstBelow(record) ? int(ErrorKind::kTargetMissed) : 0;
}

// A sequence.

namespace {

bool isWritten(const FrameRecord& frame) {
  return frame.state == FrameState::kConverted || frame.state == FrameState::kHeld ||
         frame.state == FrameState::kKept;
}

void widen(const FrameGrid& grid, GridRange& range) {
  const bool first = range.frames++ == 0;
  range.lowestActive = first ? grid.psnrActive : std::min(range.lowestActive, grid.psnrActive);
  range.highestActive = first ? grid.psnrActive : std::max(range.highestActive, grid.psnrActive);
  range.lowestBox = first ? grid.psnrBox : std::min(range.lowestBox, grid.psnrBox);
  range.highestBox = first ? grid.psnrBox : std::max(range.highestBox, grid.psnrBox);
  if (!grid.psnrT50) return;
  range.lowestT50 = std::min(range.lowestT50.value_or(*grid.psnrT50), *grid.psnrT50);
  range.highestT50 = std::max(range.highestT50.value_or(*grid.psnrT50), *grid.psnrT50);
}

Error interruption(const SequenceRecord& record) {
  const auto written = std::ranges::count_if(record.frames, isWritten);
  return RuntimeFailure("interrupted; " +
                        cli::completeOf(std::uint64_t(written), record.frames.size(), "frame") +
                        ", and --resume continues with the others");
}

}  // namespace

const char* nameOf(FrameState state) {
  return cli::wordOf(state, {{"not begun", FrameState::kNotBegun},
                             {"converted", FrameState::kConverted},
                             {"held", FrameState::kHeld},
                             {"kept", FrameState::kKept},
                             {"missing", FrameState::kMissing},
                             {"interrupted", FrameState::kInterrupted},
                             {"failed", FrameState::kFailed}});
}

void takeFigures(const RunRecord& run, FrameRecord& frame) {
  const Ratio ratio = ratioOf(run);
  frame.bytesIn = ratio.bytesIn, frame.bytesOut = ratio.bytesOut;
  frame.seconds = run.secondsTotal;
  frame.abovePreset = run.abovePreset;
  for (const ConvertedGrid& grid : run.grids) {
    const VolumeMetrics& m = grid.metrics;
    const auto light = m.transmittance ? std::optional(m.transmittance->psnr50) : std::nullopt;
    frame.grids.push_back(
        {grid.uniqueName, grid.stored().field.ellipsoidCount(), m.psnrBox, m.psnrActive, light});
    frame.before.push_back({grid.key, grid.conversion.compact});
  }
  for (const NotFitted& left : run.carried)
    frame.carried.push_back({left.grid.uniqueName, left.why});
  for (const NotFitted& left : run.skipped)
    frame.skipped.push_back({left.grid.uniqueName, left.why});
}

std::vector<cli::FrameNumber> framesIn(FrameState state, const SequenceRecord& record) {
  std::vector<cli::FrameNumber> numbers;
  for (const FrameRecord& frame : record.frames)
    if (frame.state == state) numbers.push_back(frame.frame.number);
  std::ranges::sort(numbers);
  return numbers;
}

std::vector<GridRange> gridRanges(const SequenceRecord& record) {
  std::vector<GridRange> ranges;
  std::unordered_map<std::string, std::size_t> places;
  for (const FrameRecord& frame : record.frames)
    for (const FrameGrid& grid : frame.grids) {
      const auto [place, isNew] = places.emplace(grid.name, ranges.size());
      if (isNew) ranges.push_back({.name = grid.name});
      widen(grid, ranges[place->second]);
    }
  return ranges;
}

std::optional<Error> whatIsAmiss(const SequenceRecord& record) {
  if (record.interrupted) return interruption(record);
  const auto failed = std::ranges::find(record.frames, FrameState::kFailed, &FrameRecord::state);
  if (failed != record.frames.end())
    return Error(failed->failure->kind(), cli::sentenceOn(framesIn(FrameState::kFailed, record),
                                                          record.frames.size(), "failed"));
  std::vector<cli::FrameNumber> missed;
  for (const FrameRecord& frame : record.frames)
    if (frame.missedPsnr) missed.push_back(frame.frame.number);
  if (missed.empty()) return std::nullopt;
  std::ranges::sort(missed);
  return TargetMissed(cli::sentenceOn(missed, record.frames.size(), "did not reach the PSNR"));
}

}  // namespace esvr::vdb2esvr
