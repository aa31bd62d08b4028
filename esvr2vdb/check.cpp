#include <iostream>
#include <optional>
#include <string>
#include <vector>

#include "cli/frame_messages.h"
#include "cli/printable.h"
#include "esvr/container.h"
#include "esvr/error.h"
#include "esvr/sequence_file.h"
#include "esvr2vdb/jobs.h"

namespace esvr::esvr2vdb {

namespace {

/// \throws BadInput  with a line for each fault
void throwFaults(const Options& options, const std::vector<SequenceFault>& faults,
                 std::size_t frames) {
  std::vector<cli::FrameNumber> lost;
  std::string lines;
  for (const SequenceFault& fault : faults) {
    if (fault.frame) lost.push_back(*fault.frame);
    lines += "\n  " + fault.text;
  }
  throw BadInput(options.input.string() + ": " +
                 (lost.empty() ? "it is damaged, but no frame is lost"
                               : cli::sentenceOn(lost, frames, "are lost")) +
                 lines);
}

void checkFrames(const Options& options) {
  const ReadLimits limits{options.memory.maxBytes, options.memory.voxels};
  const std::size_t frames = SequenceReader(options.input, limits).frames().size();
  const auto faults = checkSequence(options.input, limits);
  if (!faults.empty()) throwFaults(options, faults, frames);
  if (options.verbosity != cli::Verbosity::kQuiet)
    std::cout << cli::printable(options.input.string()) << ": OK\n";
}

void checkFile(const Options& options) {
  if (holdsSequence(options.input)) return checkFrames(options);
  const std::string name = cli::printable(options.input.string());
  const auto notes = checkEsvr(options.input, {options.memory.maxBytes, options.memory.voxels});
  if (options.verbosity == cli::Verbosity::kQuiet) return;
  for (const auto& note : notes) std::cout << name << ": note: " << cli::printable(note) << '\n';
  std::cout << name << ": OK\n";
}

/// Checks the file of each frame.
void checkFilesOf(const Options& options, const cli::FramePattern& pattern) {
  const cli::Log log(kProgram, options.verbosity);
  const cli::FrameListing listing = cli::framesOnDisk(pattern);
  if (const std::string hint = listing.hint(); !hint.empty())
    log.warning(pattern.text() + ": " + hint);
  std::vector<cli::FrameNumber> failed;
  std::optional<Error> first;
  for (const cli::FrameNumber frame : listing.frames) {
    Options own = options;
    own.input = pattern.toRead(frame);
    try {
      checkFile(own);
    } catch (const Error& error) {
      log.error("frame " + std::to_string(frame) + ": " + error.what());
      if (!first) first = error;
      failed.push_back(frame);
    }
  }
  if (first) throw Error(first->kind(), cli::sentenceOn(failed, listing.frames.size(), "failed"));
}

}  // namespace

void check(const Options& options) {
  if (const auto pattern = cli::FramePattern::ofInput(options.input.string()))
    return checkFilesOf(options, *pattern);
  checkFile(options);
}

}  // namespace esvr::esvr2vdb
