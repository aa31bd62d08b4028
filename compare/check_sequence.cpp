#include "compare/check_sequence.h"

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

#include "cli/frame_messages.h"
#include "compare/compare_files.h"
#include "compare/frame_source.h"
#include "compare/program.h"
#include "esvr/error.h"

namespace esvr::compare {
namespace {

using cli::FrameNumber;

struct Sources {
  std::unique_ptr<FrameSource> reference, candidate;
};

Sources openBoth(const CheckOptions& options) {
  return {FrameSource::in(options.reference.string(), options.memory),
          FrameSource::in(options.candidate.string(), options.memory)};
}

/// The frames to compare by increasing numbers: those of --frames, or those of either sequence.
std::set<FrameNumber> wantedFrames(const CheckOptions& options, const Sources& sources) {
  if (options.frames) return {options.frames->begin(), options.frames->end()};
  std::set<FrameNumber> all(sources.reference->numbers().begin(),
                            sources.reference->numbers().end());
  all.insert(sources.candidate->numbers().begin(), sources.candidate->numbers().end());
  return all;
}

bool has(const FrameSource& source, FrameNumber frame) {
  return std::ranges::binary_search(source.numbers(), frame);
}

/// Says which frames a sequence lacks.
void noteMissing(const std::set<FrameNumber>& wanted, const FrameSource& source,
                 const std::string& name, CheckRecord& record) {
  std::vector<FrameNumber> missing;
  std::ranges::copy_if(wanted, std::back_inserter(missing),
                       [&](FrameNumber frame) { return !has(source, frame); });
  if (!missing.empty())
    record.failures.push_back(cli::sentenceOn(missing, wanted.size(), "are not in " + name));
}

void appendLines(const std::string& frame, const std::vector<std::string>& lines,
                 std::vector<std::string>& all) {
  for (const auto& line : lines) all.push_back(frame + line);
}

/// Appends the record of a frame to that of the sequence.
void append(FrameNumber number, CheckRecord from, CheckRecord& to) {
  const std::string frame = "frame " + std::to_string(number) + ": ";
  for (CheckedGrid& grid : from.grids) {
    grid.frame = number;
    grid.name = frame + grid.name;
    to.grids.push_back(std::move(grid));
  }
  for (Difference& difference : from.fileDifferences) {
    difference.text = frame + difference.text;
    to.fileDifferences.push_back(std::move(difference));
  }
  appendLines(frame, from.same, to.same);
  appendLines(frame, from.skipped, to.skipped);
  appendLines(frame, from.extra, to.extra);
  appendLines(frame, from.failures, to.failures);
  appendLines(frame, from.unreadable, to.unreadable);
  appendLines(frame, from.notes, to.notes);
}

}  // namespace

bool areSequences(const CheckOptions& options) {
  const Sources sources = openBoth(options);
  return sources.reference || sources.candidate;
}

CheckRecord checkSequence(const CheckOptions& options, const CancelToken& cancel) {
  const Sources sources = openBoth(options);
  if (!sources.reference || !sources.candidate)
    throw UsageError(
        "a sequence can be compared with a sequence only: a pattern such as "
        "smoke.####.vdb, or an .esvr file that holds a sequence");
  const cli::Log log(kProgram, options.verbosity);
  for (const auto& source : {&sources.reference, &sources.candidate})
    if (const std::string hint = (*source)->hint(options.frames ? &*options.frames : nullptr);
        !hint.empty())
      log.warning(hint);
  CheckRecord record;
  const auto wanted = wantedFrames(options, sources);
  noteMissing(wanted, *sources.reference, options.reference.string(), record);
  noteMissing(wanted, *sources.candidate, options.candidate.string(), record);
  TemporalComparison temporal(options);
  std::vector<FrameNumber> compared;
  for (const FrameNumber frame : wanted) {
    if (!has(*sources.reference, frame) || !has(*sources.candidate, frame)) continue;
    const GridFile reference = sources.reference->open(frame);
    const GridFile candidate = sources.candidate->open(frame);
    temporal.beginFrame();
    append(frame, compareFiles(options, {reference, candidate, cancel}, &temporal), record);
    compared.push_back(frame);
  }
  if (compared.empty()) throw BadInput("the two sequences have no frame in common");
  record.candidateBytes = sources.candidate->bytesOf(compared);
  return record;
}

}  // namespace esvr::compare
