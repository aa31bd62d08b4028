#include "vdb2esvr/run_sequence.h"

#include <filesystem>
#include <iostream>
#include <map>
#include <system_error>

#include "cli/frame_messages.h"
#include "cli/frame_output.h"
#include "cli/frame_workers.h"
#include "cli/interrupts.h"
#include "cli/json_file.h"
#include "cli/output.h"
#include "cli/thread_limit.h"
#include "esvr/sequence_file.h"
#include "vdb2esvr/convert_groups.h"
#include "vdb2esvr/frame_conversion.h"
#include "vdb2esvr/report.h"
#include "vdb2esvr/sequence_report.h"
#include "vdb2esvr/sequence_summary.h"

namespace esvr::vdb2esvr {
namespace {

bool isThere(const std::filesystem::path& path) {
  std::error_code unreadable;  // whoever writes the file reports the reason
  return std::filesystem::exists(path, unreadable);
}

/// Converts the frames of a sequence to a file each, on several threads.
class SequenceConversion {
 public:
  SequenceConversion(const Options& options, const std::vector<cli::Frame>& frames,
                     const CancelToken& cancel)
      : options_(options),
        frames_(frames),
        cancel_(cancel),
        holders_(cli::holdersOf(frames)),
        conversion_(options, frames, cancel) {}

  SequenceRecord run() {
    const int workers = conversion_.workers(cli::countWithInput(frames_));
    cli::forEachFrame({frames_, workers, options_.sequence->onError, cancel_},
                      [&](const cli::FrameTask& task) { return convertWithHolders(task); });
    return conversion_.finish();
  }

 private:
  /// Converts a frame and repeats its output for the frames that hold it.
  /// \return false if one of them failed
  bool convertWithHolders(const cli::FrameTask& task) {
    FrameRecord& source = conversion_.frames()[task.frame];
    conversion_.attempt(source, [&] { convert(source, task.worker); });
    bool isWell = source.state != FrameState::kFailed;
    const auto [begin, end] = holders_.equal_range(task.frame);
    for (auto at = begin; at != end && source.state != FrameState::kInterrupted; ++at) {
      FrameRecord& holder = conversion_.frames()[at->second];
      conversion_.attempt(holder, [&] { hold(source, holder); });
      isWell = isWell && holder.state != FrameState::kFailed;
    }
    return isWell;
  }

  void convert(FrameRecord& record, int worker) {
    if (keep(record)) return;
    const Options own = conversion_.optionsOf(record.frame, worker);
    conversion_.convert(own, record, writingTo(own));
  }

  void hold(const FrameRecord& source, FrameRecord& holder) {
    if (source.failure) throw cli::failureToHold(source.frame, *source.failure);
    if (keep(holder)) return;
    cli::copyOutput(source.frame.output, holder.frame.output, options_.overwrite);
    holder.bytesOut = source.bytesOut;
    holder.state = FrameState::kHeld;
  }

  /// Keeps an output that is there already, if the run continues another one.
  bool keep(FrameRecord& record) const {
    if (!options_.resume || !isThere(record.frame.output)) return false;
    record.bytesOut = std::filesystem::file_size(record.frame.output);
    record.state = FrameState::kKept;
    return true;
  }

  const Options& options_;
  const std::vector<cli::Frame>& frames_;
  const CancelToken& cancel_;
  const std::multimap<std::size_t, std::size_t> holders_;
  FrameConversion conversion_;
};

SequenceRecord convertFrames(const Options& options, const CancelToken& cancel) {
  const cli::Sequence& sequence = *options.sequence;
  const auto frames = cli::planFrames(sequence, cli::Log(kProgram, options.verbosity));
  const bool isOneFile = sequence.output.isWhole();
  const bool mayExist = options.overwrite || (options.resume && !isOneFile);
  std::vector<std::filesystem::path> more{options.report};
  if (isOneFile) more.push_back(SequenceWriter::partialPath(options.output));
  cli::checkFrameOutputs(sequence, frames,
                         {.extensions = {".esvr"}, .mayExist = mayExist, .moreOutputs = more});
  return isOneFile ? convertGroups(options, frames, cancel)
                   : SequenceConversion(options, frames, cancel).run();
}

/// Converts the frames; if nothing can be converted, writes a report of the failure.
SequenceRecord convertFramesOrReport(const Options& options, const CancelToken& cancel) try {
  return convertFrames(options, cancel);
} catch (const UsageError&) {
  throw;  // the report itself may be one of the files that must not be written
} catch (const Error& error) {
  if (!options.report.empty())
    cli::writeJson({options.report, options.overwrite}, makeFailureReport(options, error));
  throw;
}

void tellSequence(const Options& options, const SequenceRecord& record) {
  if (!options.report.empty())
    cli::writeJson({options.report, options.overwrite}, makeSequenceReport(options, record));
  if (options.report != cli::kStandardOutput && options.verbosity != cli::Verbosity::kQuiet)
    printSequence(options, record, std::cout);
}

}  // namespace

int runSequence(const Options& options, const Ranks* ranks) {
  if (ranks)
    throw UsageError(
        "the ranks of MPI fit the chunks of one volume; give each process some frames of the "
        "sequence (--frames)");
  const cli::ThreadLimit threads(options.threads);
  cli::Interrupts interrupts;
  if (!options.keepsBest()) interrupts.discardResults();
  cli::requireSeparate(cli::filesOfInput(options.input.string()), {options.report});
  if (reportIsFile(options)) cli::checkOutput(options.report, {".json"}, options.overwrite);
  const SequenceRecord record = convertFramesOrReport(options, interrupts.token());
  tellSequence(options, record);
  if (const auto amiss = whatIsAmiss(record)) throw Error(*amiss);
  return 0;
}

}  // namespace esvr::vdb2esvr
