#include <iostream>
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

}  // namespace

void check(const Options& options) {
  if (holdsSequence(options.input)) return checkFrames(options);
  const std::string name = cli::printable(options.input.string());
  const auto notes = checkEsvr(options.input, {options.memory.maxBytes, options.memory.voxels});
  if (options.verbosity == cli::Verbosity::kQuiet) return;
  for (const auto& note : notes) std::cout << name << ": note: " << cli::printable(note) << '\n';
  std::cout << name << ": OK\n";
}

}  // namespace esvr::esvr2vdb
