// Converts a sequence: each frame to a file, or all frames to one file in groups.
#include "vdb2esvr/run.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <iostream>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "esvr/device.h"
#include "esvr/grid_coding.h"
#include "esvr/sequence_file.h"
#include "esvr/volume.h"
#include "programs/files.h"
#include "programs/resources.h"
#include "programs/run_main.h"
#include "programs/sequence.h"
#include "vdb2esvr/kept_frames.h"
#include "vdb2esvr/options.h"
#include "vdb2esvr/progress_bar.h"
#include "vdb2esvr/records.h"

namespace esvr::vdb2esvr {
namespace {

namespace fs = std::filesystem;

// The memory of a conversion.

/// Memory of a conversion for each brick. On two cores, that of smoke1 took 34 KB and that of
/// aneurism 60 KB.
constexpr double kBytesPerBrick = 65536.0;

/// An OpenVDB file has the mask of a leaf twice, and does not compress it.
constexpr double kLeafBytes = 2.0 * kBrickVoxels / 8.0;

/// An upper bound on the bricks of a grid. Bricks that are no leaves belong to active tiles, whose
/// voxels are all active.
double mostBricks(const VdbSummary& file, const GridSummary& grid) {
  const double voxels = double(grid.activeVoxels);
  if (file.format != "OpenVDB") return voxels;
  return std::min(voxels, double(file.fileBytes) / kLeafBytes + voxels / kBrickVoxels);
}

/// An upper estimate of the memory in bytes that the conversion of a file takes, from the summary
/// of the file. The grids are fitted one after the other, beside the bytes of all carried grids. It
/// decides how many frames are converted at the same time; no result depends on it.
std::uint64_t conversionMemory(const VdbSummary& file, const GridChoice& grids) {
  double bricks = 0.0, carried = 0.0;
  for (const FittedGrid& grid : grids.fitted)
    bricks = std::max(bricks, mostBricks(file, grid.source));
  for (const NotFitted& left : grids.carried) carried += double(left.grid.storedBytes);
  // A damaged file may claim any number of voxels.
  constexpr double kMost = 1e18;
  return std::uint64_t(std::min(bricks * kBytesPerBrick + carried, kMost));
}

// What both forms of the output have in common.

/// Converts frames, and records and tells what became of each. Several threads may convert frames
/// at the same time.
class FrameConversion {
 public:
  FrameConversion(const Options& options, const std::vector<cli::Frame>& frames,
                  const CancelToken& cancel);

  /// The number of workers for tasks that each convert one or several frames.
  [[nodiscard]] int workers(std::size_t tasks) const;

  /// Runs an action that gives a frame its output, records whether it failed, and tells that the
  /// frame has ended.
  void attempt(FrameRecord& frame, const std::function<void()>& action);

  /// The options with which a frame is converted. The bar of a fit is not shown.
  [[nodiscard]] Options optionsOf(const cli::Frame& frame, int worker) const;

  /// Converts a frame as soon as there is memory for it, on the host and on its GPU. If its GPU fails,
  /// another one of several converts it.
  /// \param own  options of the frame
  void convert(const Options& own, FrameRecord& frame, const StoreFile& store);

  [[nodiscard]] std::vector<FrameRecord>& frames() { return record_.frames; }

  /// Tells what becomes of a frame before it ends.
  void tell(const std::string& what);

  /// Ends the run and tells the warnings.
  [[nodiscard]] SequenceRecord finish();

 private:
  void convertOnDevice(const Options& own, FrameRecord& frame, const StoreFile& store);
  [[nodiscard]] Device deviceFor(std::size_t worker) const;
  bool replaceDevice(const DeviceError& error, Options& own);
  void fail(FrameRecord& frame, const Error& error);
  void tellEnd(const FrameRecord& frame);
  [[nodiscard]] double secondsSoFar();

  const Options& options_;
  const CancelToken& cancel_;
  const std::vector<Device> devices_;
  cli::MemoryGate gate_;
  std::map<int, cli::MemoryGate> deviceGates_;  ///< by Device::index
  cli::FrameWarnings warnings_;
  SequenceRecord record_;
  mutable std::mutex mutex_;     ///< of the members below
  std::vector<Device> working_;  ///< the devices that have not failed
  ProgressBar bar_;
  const cli::Log log_;
  SequenceProgress progress_;
  cli::Stopwatch watch_;
  double seconds_ = 0.0;
};

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
/// (docs/scale.md).
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

void FrameConversion::tell(const std::string& what) {
  const std::lock_guard lock(mutex_);
  bar_.hide();
  log_.info(what);
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

// A file for each frame.

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
    const auto frames = cli::framesWithInput(frames_);
    cli::forEachTask(
        {frames.size(), conversion_.workers(frames.size()), options_.sequence->onError, cancel_},
        [&](const cli::Task& task) { return convertWithHolders(frames[task.index], task.worker); });
    return conversion_.finish();
  }

 private:
  /// Converts a frame and repeats its output for the frames that hold it.
  /// \return false if one of them failed
  bool convertWithHolders(std::size_t frame, int worker) {
    FrameRecord& source = conversion_.frames()[frame];
    conversion_.attempt(source, [&] { convert(source, worker); });
    bool isWell = source.state != FrameState::kFailed;
    const auto [begin, end] = holders_.equal_range(frame);
    for (auto at = begin; at != end && source.state != FrameState::kInterrupted; ++at) {
      FrameRecord& holder = conversion_.frames()[at->second];
      conversion_.attempt(holder, [&] { hold(source, holder); });
      isWell = isWell && holder.state != FrameState::kFailed;
    }
    return isWell;
  }

  void convert(FrameRecord& record, int worker) {
    Options own = conversion_.optionsOf(record.frame, worker);
    if (keep(record, record.frame.input, own.overwrite)) return;
    conversion_.convert(own, record, writingTo(own));
  }

  void hold(const FrameRecord& source, FrameRecord& holder) {
    if (source.failure) throw cli::failureToHold(source.frame, *source.failure);
    bool overwrite = options_.overwrite;
    if (keep(holder, source.frame.output, overwrite)) return;
    cli::copyOutput(source.frame.output, holder.frame.output, overwrite);
    holder.bytesOut = source.bytesOut;
    holder.state = FrameState::kHeld;
  }

  /// Keeps an output that is there already, if the run continues another one and what it is made of has not changed.
  /// \param overwrite  becomes true if the output is older, and is replaced
  bool keep(FrameRecord& record, const fs::path& madeOf, bool& overwrite) {
    if (!options_.resume || !cli::isThere(record.frame.output)) return false;
    if (isOlder(record.frame.output, madeOf)) {
      conversion_.tell(cli::textOf(record.frame) + " is converted again: " + madeOf.string() +
                       " is newer than " + record.frame.output.string());
      overwrite = true;
      return false;
    }
    record.bytesOut = fs::file_size(record.frame.output);
    record.state = FrameState::kKept;
    return true;
  }

  const Options& options_;
  const std::vector<cli::Frame>& frames_;
  const CancelToken& cancel_;
  const std::multimap<std::size_t, std::size_t> holders_;
  FrameConversion conversion_;
};

// One file for all frames.

struct EncodedFrame {
  std::size_t index = 0;  ///< in the record
  InputState input;       ///< as it was before it was read
  std::vector<std::byte> bytes;
};

/// Converts the frames of one planned group, one after the other.
class GroupConversion {
 public:
  /// \param limits  of the memory of a decoded frame
  GroupConversion(FrameConversion& conversion, const PlannedGroup& group, int worker,
                  ReadLimits limits)
      : conversion_(conversion), group_(group), worker_(worker), limits_(std::move(limits)) {}

  /// \return false if frames are left, because the run was interrupted or stops after a failure
  bool run(const CancelToken& cancel, cli::OnFrameError onError) {
    for (const std::size_t index : group_) {
      if (cancel.cancelled()) return false;
      FrameRecord& frame = conversion_.frames()[index];
      conversion_.attempt(frame, [&] { frame.frame.holds ? hold(index) : convert(index); });
      if (frame.state == FrameState::kInterrupted) return false;
      isWell_ = isWell_ && frame.state != FrameState::kFailed;
      if (!isWell_ && onError == cli::OnFrameError::kStop) return false;
    }
    return true;
  }

  /// False if a frame failed.
  [[nodiscard]] bool isWell() const { return isWell_; }
  [[nodiscard]] std::vector<EncodedFrame>& encoded() { return encoded_; }

 private:
  void convert(std::size_t index) {
    FrameRecord& frame = conversion_.frames()[index];
    Options own = conversion_.optionsOf(frame.frame, worker_);
    own.resume = false;  // the group is converted again as a whole
    if (previous_) own.previous = {&*previous_, before_, abovePreset_};
    last_.input = stateOf(frame.frame);
    conversion_.convert(own, frame, [&](const EsvrFile& file) { return encode(index, file); });
    keepEncoded();
    before_ = std::exchange(frame.before, {});
    abovePreset_ = frame.abovePreset;
  }

  void hold(std::size_t index) {
    FrameRecord& frame = conversion_.frames()[index];
    const FrameRecord& source = conversion_.frames()[*frame.frame.holds];
    if (source.failure) throw cli::failureToHold(source.frame, *source.failure);
    last_.input = {};
    frame.bytesOut = encode(index, *previous_).fileBytes;
    keepEncoded();
    frame.state = FrameState::kHeld;
  }

  /// Encodes a frame and decodes it again, because the next frame refers to what a reader gets.
  EsvrSummary encode(std::size_t index, const EsvrFile& file) {
    FrameRecord& frame = conversion_.frames()[index];
    frame.gridsDiffer = previous_ && !haveSameGrids(*previous_, file);
    const EsvrFile* before = previous_ && !frame.gridsDiffer ? &*previous_ : nullptr;
    const std::string name = cli::textOf(frame.frame);
    last_.index = index;
    last_.bytes = encodeFrame(file, before);
    decoded_ = decodeFrame(last_.bytes, name, limits_, before);
    return inspectEsvr(last_.bytes, name);
  }

  /// Takes the frame that was encoded last into the group, after nothing can fail any more.
  void keepEncoded() {
    previous_ = std::move(decoded_);
    encoded_.push_back(std::move(last_));
  }

  FrameConversion& conversion_;
  const PlannedGroup& group_;
  const int worker_;
  const ReadLimits limits_;
  bool isWell_ = true;
  std::vector<EncodedFrame> encoded_;
  std::optional<EsvrFile> previous_;  ///< the last frame of the group as a reader gets it
  std::vector<GridBefore> before_;    ///< FrameBefore::grids of it
  double abovePreset_ = 0.0;          ///< FrameBefore::abovePreset of it
  EncodedFrame last_;                 ///< the frame that was encoded last
  EsvrFile decoded_;                  ///< the same as a reader gets it
};

PartialSequence partialOf(const Options& options) {
  if (options.resume) return PartialSequence::kResume;
  return options.overwrite ? PartialSequence::kReplace : PartialSequence::kRefuse;
}

void checkPartial(const Options& options) {
  const fs::path partial = SequenceWriter::partialPath(options.output);
  std::error_code unreadable;  // the writer reports the reason
  if (partialOf(options) == PartialSequence::kRefuse && fs::exists(partial, unreadable))
    throw RuntimeFailure(partial.string() +
                         " is there, which an interrupted run has left; --resume continues it, "
                         "and --force replaces it");
}

/// Converts groups on several threads and appends them to the file.
class FileOfGroups {
 public:
  FileOfGroups(const Options& options, const std::vector<cli::Frame>& frames,
               const CancelToken& cancel)
      : options_(options),
        cancel_(cancel),
        groups_(planGroups(frames)),
        conversion_(options, frames, cancel),
        writer_(options.output, {options.overwrite, partialOf(options), hashOfOrigin(options)}),
        inputs_(SequenceWriter::partialPath(options.output), options.resume) {
    keepGroups(frames);
  }

  SequenceRecord run() {
    const std::size_t left = groups_.size() - first_;
    cli::forEachTask({left, conversion_.workers(left), options_.sequence->onError, cancel_},
                     [&](const cli::Task& task) { return convert(task); });
    markLost();
    FileFigures file{.groups = writer_.groupCount()};
    if (appended_ == left && file.groups > 0) {
      file.bytes = writer_.finish();
      inputs_.remove();
    }
    SequenceRecord record = conversion_.finish();
    record.file = file;
    return record;
  }

 private:
  void keepGroups(const std::vector<cli::Frame>& frames) {
    KeptGroups kept = keptGroups(frames, groups_, writer_.frames());
    if (const auto changed = keepUnchanged(inputs_, frames, groups_, writer_.frames(), kept))
      conversion_.tell(changed->input.string() + " is not as it was when " + cli::textOf(*changed) +
                       " was converted; the frames from " +
                       std::to_string(frames[groups_[kept.planned].front()].number) +
                       " on are converted again");
    if (kept.stored < writer_.groupCount()) writer_.dropGroups(kept.stored);
    first_ = kept.planned;
    auto record = conversion_.frames().begin();
    for (const SequenceFrame& frame : writer_.frames()) {
      while (record->frame.number != frame.number) ++record;
      record->bytesOut = frame.bytes;
      record->group = frame.group;
      conversion_.attempt(*record, [&] { record->state = FrameState::kKept; });
    }
  }

  /// Converts a group and appends it when it is its turn.
  bool convert(const cli::Task& task) try {
    GroupConversion group(conversion_, groups_[first_ + task.index], task.worker,
                          {options_.read.maxBytes, options_.read.memory});
    const bool isComplete = group.run(cancel_, options_.sequence->onError);
    if (!turnstile_.await(task.index)) return group.isWell();
    if (isComplete) append(group.encoded()), turnstile_.pass();
    if (!isComplete) turnstile_.close();
    return group.isWell();
  } catch (...) {
    turnstile_.close();
    throw;
  }

  void append(std::vector<EncodedFrame>& frames) {
    const Completion completion;  // a group that is converted is kept
    for (const EncodedFrame& frame : frames)
      inputs_.add(conversion_.frames()[frame.index].frame, frame.input);
    for (EncodedFrame& frame : frames) {
      FrameRecord& record = conversion_.frames()[frame.index];
      if (record.gridsDiffer) writer_.endGroup();
      record.group = writer_.groupCount();
      writer_.append(record.frame.number, std::move(frame.bytes));
    }
    writer_.endGroup();
    ++appended_;
  }

  /// Frames that were converted, but whose group is not in the file, must be converted again.
  void markLost() {
    for (FrameRecord& frame : conversion_.frames())
      if (!frame.group &&
          (frame.state == FrameState::kConverted || frame.state == FrameState::kHeld))
        frame.state = FrameState::kInterrupted;
  }

  const Options& options_;
  const CancelToken& cancel_;
  const std::vector<PlannedGroup> groups_;
  FrameConversion conversion_;
  SequenceWriter writer_;
  FrameInputs inputs_;
  std::size_t first_ = 0;  ///< the first planned group that is not in the file yet
  cli::Turnstile turnstile_;
  std::size_t appended_ = 0;  ///< planned groups that this run appended; guarded by the turnstile
};

/// The frames of a group are converted one after the other, because they may refer to each other;
/// several groups are converted at the same time. If the run is interrupted or stops after a failure,
/// the complete groups stay in the partial file.
SequenceRecord convertGroups(const Options& options, const std::vector<cli::Frame>& frames,
                             const CancelToken& cancel) {
  checkPartial(options);
  return FileOfGroups(options, frames, cancel).run();
}

// The run.

SequenceRecord convertFrames(const Options& options, const CancelToken& cancel) {
  const cli::Sequence& sequence = *options.sequence;
  const auto frames = cli::planFrames(sequence, cli::Log(kProgram, options.verbosity));
  const bool isOneFile = sequence.output.isWhole();
  const bool mayExist = options.overwrite || (options.resume && !isOneFile);
  std::vector<fs::path> more{options.report};
  if (isOneFile) {
    const fs::path partial = SequenceWriter::partialPath(options.output);
    more.insert(more.end(), {partial, FrameInputs::pathFor(partial)});
  }
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
  const Completion completion;  // an interrupted run tells what it has written
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
