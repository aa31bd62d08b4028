#include "vdb2esvr/frame_conversion.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "cli/failure.h"
#include "cli/frame_messages.h"
#include "cli/frame_workers.h"
#include "vdb2esvr/frame_memory.h"
#include "vdb2esvr/report.h"
#include "vdb2esvr/sequence_report.h"

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

/// The largest number of frames that a GPU converts at the same time, since a conversion uses it for
/// a part of its time only. Three groups at a time took a third of the time of one after the other
/// (docs/sequences.md).
constexpr int kFramesOfGpu = 4;

bool fitsOn(const Device& device, const Options& options) {
  return device.kind == DeviceKind::kCuda && mayFit(options);
}

/// Bytes of a device's memory that frames may share: half of a GPU's, because the memory of fits is
/// not known before they begin. The memory of the host has a gate of its own.
std::uint64_t sharedMemoryOf(const Device& device, const Options& options) {
  if (!fitsOn(device, options)) return std::numeric_limits<std::uint64_t>::max();
  const bool isLimited = options.convert.fit.maxDeviceBytes || options.convert.fit.seconds;
  constexpr std::uint64_t kOneAfterTheOther = 1;  // every frame needs more and is let in alone
  return isLimited ? kOneAfterTheOther : std::max(freeDeviceMemory(device) / 2, kOneAfterTheOther);
}

/// The memory that the conversion of a file may take, bytes.
std::uint64_t memoryOf(Options options) {
  const VdbSummary file = inspectVdb(options.input);
  return conversionMemory(file, chooseFor(options, file));
}

}  // namespace

FrameConversion::FrameConversion(const Options& options, const std::vector<cli::Frame>& frames,
                                 const CancelToken& cancel)
    : options_(options),
      cancel_(cancel),
      devices_(selectDevices(options.device)),
      gate_(options.read.maxBytes),
      working_(devices_),
      bar_(options.input.string(), options.progress, options.verbosity),
      log_(kProgram, options.verbosity) {
  for (const Device& device : devices_)
    if (!deviceGates_.contains(device.index))
      deviceGates_.try_emplace(device.index, sharedMemoryOf(device, options));
  for (const cli::Frame& frame : frames) {
    const bool isLeftOut = frame.missing && !frame.holds;
    record_.frames.push_back(
        {.frame = frame, .state = isLeftOut ? FrameState::kMissing : FrameState::kNotBegun});
    if (!isLeftOut) ++progress_.frames;
  }
}

int FrameConversion::workers(std::size_t tasks) const {
  const int most = cli::taskWorkers(options_.threads, tasks);
  return fitsOn(devices_.front(), options_) ? std::min(most, kFramesOfGpu * int(devices_.size()))
                                            : most;
}

void FrameConversion::attempt(FrameRecord& frame, const std::function<void()>& action) {
  try {
    action();
  } catch (...) {
    fail(frame, cli::currentFailure());
  }
  tellEnd(frame);
}

void FrameConversion::fail(FrameRecord& frame, const Error& error) {
  frame.state = cancel_.cancelled() ? FrameState::kInterrupted : FrameState::kFailed;
  frame.failure = error;
  if (!options_.report.empty())
    frame.report = frameReport(makeFailureReport(optionsOf(frame.frame, 0), error));
}

Options FrameConversion::optionsOf(const cli::Frame& frame, int worker) const {
  Options own = options_;
  own.input = frame.input, own.output = frame.output;
  if (devices_.size() > 1) own.device = deviceOption(deviceFor(std::size_t(worker)));
  own.progress = ProgressForm::kText;
  own.verbosity = cli::Verbosity::kQuiet;
  return own;
}

/// One of the devices that have not failed.
Device FrameConversion::deviceFor(std::size_t worker) const {
  const std::lock_guard lock(mutex_);
  const Device& own = devices_[worker % devices_.size()];
  if (std::ranges::count(working_, own) > 0) return own;
  return working_[worker % working_.size()];
}

/// Gives a frame whose device has failed another one, and all later frames.
/// \return false if none is left
bool FrameConversion::replaceDevice(const DeviceError& error, Options& own) {
  if (devices_.size() < 2) return false;
  const Device failed = selectDevices(own.device).front();
  const std::lock_guard lock(mutex_);
  std::vector<Device> left = working_;
  const bool isNew = std::erase(left, failed) > 0;
  if (left.empty()) return false;
  working_ = std::move(left);
  own.device = deviceOption(working_.front());
  if (!isNew) return true;
  bar_.hide();
  log_.warning(deviceName(failed) + " is not used any more: " + error.what() +
               "; the other devices go on");
  return true;
}

void FrameConversion::convert(const Options& given, FrameRecord& frame, const StoreFile& store) {
  Options own = given;
  for (;;) {
    try {
      return convertOnDevice(own, frame, store);
    } catch (const DeviceError& error) {
      if (!replaceDevice(error, own)) throw;
    }
  }
}

void FrameConversion::convertOnDevice(const Options& own, FrameRecord& frame,
                                      const StoreFile& store) {
  const std::uint64_t bytes = memoryOf(own);
  const auto memory = gate_.take(bytes);
  const auto onDevice = deviceGates_.at(selectDevices(own.device).front().index).take(bytes);
  const cli::Log log = warnings_.logOf(frame.frame, kProgram, verbosityOfFrames(options_));
  const RunRecord run = convertFile(own, {nullptr, cancel_, log, store});
  takeFigures(run, frame);
  frame.state = run.interrupted ? FrameState::kInterrupted : FrameState::kConverted;
  frame.missedPsnr = firstBelow(run) != nullptr;
  if (!options_.report.empty()) frame.report = frameReport(makeReport(own, run));
}

void FrameConversion::tellEnd(const FrameRecord& frame) {
  const std::lock_guard lock(mutex_);
  ++progress_.done;
  if (frame.state == FrameState::kFailed) {
    ++progress_.failed;
    bar_.hide();
    log_.error(cli::textOf(frame.frame) + ": " + frame.failure->what());
  }
  progress_.frame = frame.frame.number;
  progress_.state = nameOf(frame.state);
  progress_.seconds = secondsSoFar();
  bar_.show(progress_);
}

double FrameConversion::secondsSoFar() {
  seconds_ += watch_.lap();
  return seconds_;
}

SequenceRecord FrameConversion::finish() {
  record_.interrupted = cancel_.cancelled();
  record_.seconds = secondsSoFar();
  warnings_.tell(log_);
  return std::move(record_);
}

}  // namespace esvr::vdb2esvr
