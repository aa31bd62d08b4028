#include "vdb2esvr/convert_groups.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>

#include "cli/frame_messages.h"
#include "cli/frame_workers.h"
#include "cli/turnstile.h"
#include "esvr/frame_coding.h"
#include "esvr/sequence_file.h"
#include "vdb2esvr/frame_conversion.h"
#include "vdb2esvr/group_plan.h"
#include "vdb2esvr/same_grids.h"

namespace esvr::vdb2esvr {
namespace {

namespace fs = std::filesystem;

struct EncodedFrame {
  std::size_t index = 0;  ///< in the record
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
    own.previous = previous_ ? &*previous_ : nullptr;
    conversion_.convert(own, frame, [&](const EsvrFile& file) { return encode(index, file); });
    keepEncoded();
  }

  void hold(std::size_t index) {
    FrameRecord& frame = conversion_.frames()[index];
    const FrameRecord& source = conversion_.frames()[*frame.frame.holds];
    if (source.failure) throw cli::failureToHold(source.frame, *source.failure);
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
    last_ = {index, encodeFrame(file, before)};
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
        writer_(options.output, {options.overwrite, partialOf(options)}) {
    keepGroups(frames);
  }

  SequenceRecord run() {
    const std::size_t left = groups_.size() - first_;
    cli::forEachTask({left, conversion_.workers(left), options_.sequence->onError, cancel_},
                     [&](const cli::Task& task) { return convert(task); });
    markLost();
    FileFigures file{.groups = writer_.groupCount()};
    if (appended_ == left && file.groups > 0) file.bytes = writer_.finish();
    SequenceRecord record = conversion_.finish();
    record.file = file;
    return record;
  }

 private:
  void keepGroups(const std::vector<cli::Frame>& frames) {
    const KeptGroups kept = keptGroups(frames, groups_, writer_.frames());
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
  std::size_t first_ = 0;  ///< the first planned group that is not in the file yet
  cli::Turnstile turnstile_;
  std::size_t appended_ = 0;  ///< planned groups that this run appended; guarded by the turnstile
};

}  // namespace

SequenceRecord convertGroups(const Options& options, const std::vector<cli::Frame>& frames,
                             const CancelToken& cancel) {
  checkPartial(options);
  return FileOfGroups(options, frames, cancel).run();
}

}  // namespace esvr::vdb2esvr
