#include "vdb2esvr/run_sequence.h"

#include <filesystem>
#include <functional>
#include <iostream>
#include <map>
#include <mutex>
#include <system_error>
#include <utility>

#include "cli/failure.h"
#include "cli/frame_messages.h"
#include "cli/frame_output.h"
#include "cli/frame_warnings.h"
#include "cli/frame_workers.h"
#include "cli/interrupts.h"
#include "cli/json_file.h"
#include "cli/memory_gate.h"
#include "cli/output.h"
#include "cli/stopwatch.h"
#include "cli/thread_limit.h"
#include "esvr/device.h"
#include "vdb2esvr/frame_memory.h"
#include "vdb2esvr/progress_bar.h"
#include "vdb2esvr/report.h"
#include "vdb2esvr/run.h"
#include "vdb2esvr/sequence_report.h"
#include "vdb2esvr/sequence_summary.h"

namespace esvr::vdb2esvr {
namespace {

/// The value of --device that selects one of several devices.
std::string deviceOption(const Device& device) {
  return device.kind == DeviceKind::kCpu ? "cpu" : "cuda:" + std::to_string(device.index);
}

/// Messages of frames: warnings unless --quiet was given, but no details, because frames that are
/// converted at the same time would mix them.
cli::Verbosity verbosityOfFrames(const Options& options) {
  return options.verbosity == cli::Verbosity::kQuiet ? cli::Verbosity::kQuiet
                                                     : cli::Verbosity::kNormal;
}

/// The memory that the conversion of a file may take, bytes.
std::uint64_t memoryOf(const Options& options) {
  const VdbSummary file = inspectVdb(options.input);
  return conversionMemory(file, chooseGrids(options.input, file, options.grids));
}

bool isThere(const std::filesystem::path& path) {
  std::error_code unreadable;  // whoever writes the file reports the reason
  return std::filesystem::exists(path, unreadable);
}

/// Converts the frames of a sequence on several threads.
class SequenceConversion {
 public:
  SequenceConversion(const Options& options, const std::vector<cli::Frame>& frames,
                     const CancelToken& cancel)
      : options_(options),
        frames_(frames),
        cancel_(cancel),
        devices_(selectDevices(options.device)),
        holders_(cli::holdersOf(frames)),
        gate_(options.read.maxBytes),
        bar_(options.input.string(), options.progress, options.verbosity),
        log_(kProgram, options.verbosity) {
    for (const cli::Frame& frame : frames) {
      const bool isLeftOut = frame.missing && !frame.holds;
      record_.frames.push_back(
          {.frame = frame, .state = isLeftOut ? FrameState::kMissing : FrameState::kNotBegun});
      if (!isLeftOut) ++progress_.frames;
    }
  }

  SequenceRecord run() {
    cli::forEachFrame({frames_, workers(), options_.sequence->onError, cancel_},
                      [&](const cli::FrameTask& task) { return convertWithHolders(task); });
    record_.interrupted = cancel_.cancelled();
    record_.seconds = secondsSoFar();
    warnings_.tell(log_);
    return std::move(record_);
  }

 private:
  /// A GPU converts one frame after the other, because a fit may take all of its memory.
  [[nodiscard]] int workers() const {
    if (mayFit(options_) && devices_.front().kind == DeviceKind::kCuda) return int(devices_.size());
    return cli::frameWorkers(options_.threads, frames_);
  }

  /// Converts a frame and repeats its output for the frames that hold it.
  /// \return false if one of them failed
  bool convertWithHolders(const cli::FrameTask& task) {
    FrameRecord& source = record_.frames[task.frame];
    attempt(source, [&] { convert(source, task.worker); });
    bool isWell = source.state != FrameState::kFailed;
    const auto [begin, end] = holders_.equal_range(task.frame);
    for (auto at = begin; at != end && source.state != FrameState::kInterrupted; ++at) {
      FrameRecord& holder = record_.frames[at->second];
      attempt(holder, [&] { hold(source, holder); });
      isWell = isWell && holder.state != FrameState::kFailed;
    }
    return isWell;
  }

  /// Runs an action that gives a frame its output, and records whether it failed.
  void attempt(FrameRecord& frame, const std::function<void()>& action) {
    try {
      action();
    } catch (...) {
      fail(frame, cli::currentFailure());
    }
    tellEnd(frame);
  }

  void fail(FrameRecord& frame, const Error& error) {
    frame.state = cancel_.cancelled() ? FrameState::kInterrupted : FrameState::kFailed;
    frame.failure = error;
    if (!options_.report.empty())
      frame.report = frameReport(makeFailureReport(optionsOf(frame.frame, 0), error));
  }

  void convert(FrameRecord& record, int worker) {
    if (keep(record)) return;
    const Options own = optionsOf(record.frame, worker);
    const auto memory = gate_.take(memoryOf(own));
    const cli::FrameFolder folder(own.output);
    const cli::Log log = warnings_.logOf(record.frame, kProgram, verbosityOfFrames(options_));
    const RunRecord run = convertFile(own, nullptr, cancel_, log);
    takeFigures(run, record);
    record.state = run.interrupted ? FrameState::kInterrupted : FrameState::kConverted;
    record.missedPsnr = firstBelow(run, own.psnr) != nullptr;
    if (!options_.report.empty()) record.report = frameReport(makeReport(own, run));
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

  /// The options with which a frame is converted as a file. The bar of a fit is not shown.
  [[nodiscard]] Options optionsOf(const cli::Frame& frame, int worker) const {
    Options own = options_;
    own.input = frame.input, own.output = frame.output;
    if (devices_.size() > 1)
      own.device = deviceOption(devices_[std::size_t(worker) % devices_.size()]);
    own.progress = ProgressForm::kText;
    own.verbosity = cli::Verbosity::kQuiet;
    return own;
  }

  void tellEnd(const FrameRecord& record) {
    const std::lock_guard lock(mutex_);
    ++progress_.done;
    if (record.state == FrameState::kFailed) {
      ++progress_.failed;
      bar_.hide();
      log_.error(cli::textOf(record.frame) + ": " + record.failure->what());
    }
    progress_.frame = record.frame.number;
    progress_.state = nameOf(record.state);
    progress_.seconds = secondsSoFar();
    bar_.show(progress_);
  }

  [[nodiscard]] double secondsSoFar() {
    seconds_ += watch_.lap();
    return seconds_;
  }

  const Options& options_;
  const std::vector<cli::Frame>& frames_;
  const CancelToken& cancel_;
  const std::vector<Device> devices_;
  const std::multimap<std::size_t, std::size_t> holders_;
  cli::MemoryGate gate_;
  cli::FrameWarnings warnings_;
  SequenceRecord record_;
  std::mutex mutex_;  ///< of the members below
  ProgressBar bar_;
  const cli::Log log_;
  SequenceProgress progress_;
  cli::Stopwatch watch_;
  double seconds_ = 0.0;
};

SequenceRecord convertFrames(const Options& options, const CancelToken& cancel) {
  const cli::Sequence& sequence = *options.sequence;
  const auto frames = cli::planFrames(sequence);
  cli::checkFrameOutputs(sequence, frames, {{".esvr"}, options.overwrite || options.resume});
  return SequenceConversion(options, frames, cancel).run();
}

/// Converts the frames; if nothing can be converted, writes a report of the failure.
SequenceRecord convertFramesOrReport(const Options& options, const CancelToken& cancel) try {
  return convertFrames(options, cancel);
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
  const cli::Interrupts interrupts;
  if (reportIsFile(options)) cli::checkOutput(options.report, {".json"}, options.overwrite);
  const SequenceRecord record = convertFramesOrReport(options, interrupts.token());
  tellSequence(options, record);
  if (const auto amiss = whatIsAmiss(record)) throw Error(*amiss);
  return 0;
}

}  // namespace esvr::vdb2esvr
