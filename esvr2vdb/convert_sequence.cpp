// Writes a VDB for each frame of a sequence, on several threads.
#include "esvr2vdb/jobs.h"

#include <algorithm>
#include <iostream>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "esvr/error.h"
#include "esvr/sequence_file.h"
#include "programs/files.h"
#include "programs/resources.h"
#include "programs/run_main.h"
#include "programs/sequence.h"

namespace esvr::esvr2vdb {
namespace {

using FrameIndices = std::vector<std::size_t>;

/// The groups of the frames in a file, by the number of the frame.
std::map<cli::FrameNumber, std::size_t> groupsIn(const std::string& path) {
  std::map<cli::FrameNumber, std::size_t> groups;
  const SequenceReader reader(path);
  for (const SequenceFrame& frame : reader.frames()) groups[frame.number] = frame.group;
  return groups;
}

/// The frames that one thread decodes one after the other: each alone if it is a file, or those of
/// a group by increasing numbers, because they may refer to each other.
std::vector<FrameIndices> tasksFor(const cli::Sequence& sequence,
                                   const std::vector<cli::Frame>& frames) {
  const bool isOneFile = sequence.input.isWhole();
  const auto groups =
      isOneFile ? groupsIn(sequence.input.text()) : std::map<cli::FrameNumber, std::size_t>{};
  std::map<std::size_t, std::map<cli::FrameNumber, std::size_t>> tasks;
  for (std::size_t i = 0; i < frames.size(); ++i)
    if (!frames[i].missing)
      tasks[isOneFile ? groups.at(frames[i].number) : i][frames[i].number] = i;
  std::vector<FrameIndices> lists;
  for (const auto& task : tasks) {
    FrameIndices& list = lists.emplace_back();
    for (const auto& frame : task.second) list.push_back(frame.second);
  }
  return lists;
}

/// Reads frames of one file. The limit of the memory may change.
class FileOfFrames {
 public:
  explicit FileOfFrames(std::filesystem::path path) : path_(std::move(path)) {}

  const EsvrFile& read(cli::FrameNumber number, const ReadLimits& limits) {
    if (!reader_ || maxBytes_ != limits.maxBytes)
      reader_ = std::make_unique<SequenceReader>(path_, limits);
    maxBytes_ = limits.maxBytes;
    return reader_->read(number);
  }

  /// A frame needed more than its share of the memory. The later frames of its group get all of it,
  /// too, because each change of the limit decodes the group again from its beginning.
  bool needsAll = false;

 private:
  std::filesystem::path path_;
  std::unique_ptr<SequenceReader> reader_;
  std::uint64_t maxBytes_ = 0;
};

/// Decodes the frames of a sequence on several threads.
class SequenceDecoding {
 public:
  SequenceDecoding(const Options& options, const std::vector<cli::Frame>& frames,
                   const CancelToken& cancel)
      : options_(options),
        frames_(frames),
        cancel_(cancel),
        watched_({options.input}),
        holders_(cli::holdersOf(frames)),
        tasks_(tasksFor(*options.sequence, frames)),
        workers_(cli::taskWorkers(options.threads, tasks_.size())),
        gate_(options.memory.maxBytes),
        log_(kProgram, options.verbosity),
        done_(frames.size()) {}

  void run() {
    cli::forEachTask({tasks_.size(), workers_, options_.sequence->onError, cancel_},
                     [&](const cli::Task& task) { return decodeTask(tasks_[task.index]); });
    warnings_.tell(log_);
    for (std::size_t i = 0; i < frames_.size(); ++i) printTable(i);
    throwWhatIsAmiss();
  }

 private:
  struct Done {
    bool isWritten = false;
    std::string table;  ///< errors against the reference
    std::optional<Error> failure{};
  };

  /// Decodes the frames of a task one after the other.
  /// \return false if one of them failed
  bool decodeTask(const FrameIndices& frames) {
    FileOfFrames file(options_.input);
    bool isWell = true;
    for (const std::size_t frame : frames) {
      const bool stops = !isWell && options_.sequence->onError == cli::OnFrameError::kStop;
      if (stops || cancel_.cancelled()) break;
      isWell = decodeWithHolders(frame, file) && isWell;
    }
    return isWell;
  }

  /// Decodes a frame and repeats its output for the frames that hold it.
  /// \return false if one of them failed
  bool decodeWithHolders(std::size_t source, FileOfFrames& file) {
    bool isWell = attempt(source, [&] { decode(source, file); });
    const auto [begin, end] = holders_.equal_range(source);
    for (auto at = begin; at != end && !cancel_.cancelled(); ++at)
      isWell = attempt(at->second, [&] { hold(source, at->second); }) && isWell;
    return isWell;
  }

  /// Runs an action that gives a frame its output, and records whether it failed.
  template <class Action>
  bool attempt(std::size_t i, const Action& action) {
    try {
      action();
      done_[i].isWritten = true;
    } catch (...) {
      const Error error = cli::currentFailure();
      if (cancel_.cancelled()) return false;
      done_[i].failure = error;
      const std::lock_guard lock(mutex_);
      log_.error(cli::textOf(frames_[i]) + ": " + error.what());
    }
    return !done_[i].failure;
  }

  /// Decodes a frame with its share of the memory. A frame that needs more is decoded alone.
  void decode(std::size_t i, FileOfFrames& file) {
    const std::uint64_t share = options_.memory.maxBytes / std::uint64_t(workers_);
    if (!file.needsAll) try {
        const auto part = gate_.take(share);
        return decodeWithin(i, share, file);
      } catch (const MemoryExceeded&) {
        if (workers_ == 1) throw;
        file.needsAll = options_.sequence->input.isWhole();
      }
    const auto all = gate_.takeAll();
    decodeWithin(i, options_.memory.maxBytes, file);
  }

  void decodeWithin(std::size_t i, std::uint64_t maxBytes, FileOfFrames& file) {
    const cli::Frame& frame = frames_[i];
    Options own = options_;
    own.memory.maxBytes = own.write.maxBytes = maxBytes;
    own.input = frame.input, own.output = frame.output;
    if (own.reference)
      own.reference = cli::FramePattern::ofInput(own.reference->string())->toRead(frame.number);
    const cli::Log log = warnings_.logOf(frame, kProgram, own.verbosity);
    std::ostringstream table;
    if (options_.sequence->input.isWhole()) {
      const EsvrFile& content = file.read(frame.number, limitsOf(own));
      watched_.requireUnchanged();
      convertContent(own, {content}, cancel_, log, table);
    } else {
      convertFile(own, cancel_, log, table);
    }
    done_[i].table = table.str();
  }

  void hold(std::size_t source, std::size_t holder) {
    if (const auto& failure = done_[source].failure)
      throw cli::failureToHold(frames_[source], *failure);
    cli::copyOutput(frames_[source].output, frames_[holder].output, options_.write.overwrite);
  }

  void printTable(std::size_t i) const {
    if (!done_[i].table.empty())
      std::cout << "frame " << frames_[i].number << ":\n" << done_[i].table;
  }

  void throwWhatIsAmiss() const {
    const auto written = std::ranges::count_if(done_, &Done::isWritten);
    if (cancel_.cancelled())
      throw RuntimeFailure("interrupted; " +
                           cli::completeOf(std::uint64_t(written), frames_.size(), "frame"));
    std::vector<cli::FrameNumber> failed;
    for (std::size_t i = 0; i < frames_.size(); ++i)
      if (done_[i].failure) failed.push_back(frames_[i].number);
    if (failed.empty()) return;
    std::ranges::sort(failed);
    const auto first =
        std::ranges::find_if(done_, [](const Done& done) { return done.failure.has_value(); });
    throw Error(first->failure->kind(), cli::sentenceOn(failed, frames_.size(), "failed"));
  }

  const Options& options_;
  const std::vector<cli::Frame>& frames_;
  const CancelToken& cancel_;
  const cli::WatchedInputs watched_;  ///< the file of all frames, which each task opens; or nothing
  const std::multimap<std::size_t, std::size_t> holders_;
  const std::vector<FrameIndices> tasks_;
  const int workers_;
  cli::MemoryGate gate_;
  cli::FrameWarnings warnings_;
  std::mutex mutex_;  ///< guards the log
  const cli::Log log_;
  std::vector<Done> done_;
};

/// Frames of splats do not fit together where each has a size, a density or colors of its own.
void tellWhatDiffers(const Options& options, const cli::Log& log) {
  const SplatOptions& made = options.splats.made;
  std::string own;
  const auto add = [&](const char* what) { own += std::string(own.empty() ? "" : ", ") + what; };
  if (options.output.extension() == ".ply" && made.form == SplatForm::kPly)
    add("middle and size (--kind mitsuba: those of the world)");
  if (!made.densityScale) add("density scale (--density-scale: one for all)");
  if (made.colors.points.size() > 1) add("range of colors (--colors R,G,B: one color)");
  if (!own.empty()) log.warning("the splats of each frame have their own " + own);
}

}  // namespace

void convertSequence(const Options& options) {
  const cli::Interrupts interrupts;
  const cli::Sequence& sequence = *options.sequence;
  const auto frames = cli::planFrames(sequence, cli::Log(kProgram, options.verbosity));
  std::vector<std::filesystem::path> references;
  if (options.reference) references = cli::filesOfInput(options.reference->string());
  cli::checkFrameOutputs(sequence, frames,
                         {.extensions = {".vdb", ".nvdb", ".ply", ".usda"},
                          .mayExist = options.write.overwrite,
                          .moreInputs = references});
  if (writesSplats(options) && frames.size() > 1)
    tellWhatDiffers(options, cli::Log(kProgram, options.verbosity));
  SequenceDecoding(options, frames, interrupts.token()).run();
}

}  // namespace esvr::esvr2vdb
