#pragma once
/// The memory of a program: what the machine has, the options --max-memory and --scratch, and the
/// shares of tasks; and its threads: the option --threads, frames and other tasks on several threads, and the order of their
/// results.

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "esvr/device.h"
#include "esvr/volume.h"
#include "programs/command_line.h"
#include "programs/sequence.h"

namespace esvr::cli {

/// Bytes of physical memory.
[[nodiscard]] std::uint64_t physicalMemory();

/// Bytes that the process can still allocate before the system has to swap, or before a limit of
/// its control group or of its address space is reached.
[[nodiscard]] std::uint64_t availableMemory();

/// The largest amount of memory that the process has held, in bytes.
[[nodiscard]] std::uint64_t peakMemory();

/// Measures by how much the memory of the process grows during a step.
class MemoryMeter {
 public:
  /// Starts a step. It returns free memory to the system and resets the system's record of the
  /// peak.
  MemoryMeter();
  /// The growth in bytes; nothing if the system keeps no such record.
  [[nodiscard]] std::optional<std::uint64_t> peakRise() const;

 private:
  std::optional<std::uint64_t> before_;
};

// The options --max-memory and --scratch.

/// The memory of the host that a program may take.
struct HostMemory {
  std::uint64_t maxBytes = kNoMemoryLimit;  ///< voxels in files do not count
  VoxelMemory voxels{};                     ///< holds voxels in files if they need a large share
};

/// Adds the options.
void addHostMemory(CommandLine& line);

/// The limit, which is the value of --max-memory or a share of the memory that is available, and
/// files in the folder of --scratch.
/// \throws UsageError  the value is not a size, or the folder does not exist
[[nodiscard]] HostMemory hostMemoryOf(const Arguments& arguments);

/// The folder of --scratch, or that of the variable TMPDIR, or /var/tmp: /tmp is in memory on many
/// systems.
/// \throws UsageError  the folder does not exist
[[nodiscard]] std::filesystem::path scratchFolderOf(const Arguments& arguments);

/// The same without options.
[[nodiscard]] std::filesystem::path scratchFolder();

// Tasks on several threads begin only while there is memory for them.

/// An amount of memory that tasks share. They take their parts in the order in which they ask, so
/// that a large task does not wait forever.
class MemoryGate {
 public:
  explicit MemoryGate(std::uint64_t bytes) : all_(bytes) {}

  /// The memory of a task. It is given back when the object goes out of scope.
  class Part {
   public:
    Part(MemoryGate& gate, std::uint64_t bytes) : gate_(gate), bytes_(bytes) {}
    ~Part() { gate_.giveBack(bytes_); }
    Part(const Part&) = delete;
    Part& operator=(const Part&) = delete;

   private:
    MemoryGate& gate_;
    std::uint64_t bytes_;
  };

  /// Waits until there is enough memory. A task that needs more than there is runs alone.
  [[nodiscard]] Part take(std::uint64_t bytes);
  [[nodiscard]] Part takeAll() { return take(all_); }

 private:
  void giveBack(std::uint64_t bytes);

  const std::uint64_t all_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::uint64_t taken_ = 0;
  std::uint64_t nextTicket_ = 0, served_ = 0;
};

// ---- Devices and ranks

/// While it exists, parallel loops use at most `threads` threads; 0 sets no limit.
class ThreadLimit {
 public:
  explicit ThreadLimit(int threads);
  ~ThreadLimit();
  ThreadLimit(const ThreadLimit&) = delete;
  ThreadLimit& operator=(const ThreadLimit&) = delete;

 private:
  struct Control;
  std::unique_ptr<Control> control_;
};

struct TaskRun {
  std::size_t tasks = 0;
  int workers = 1;
  OnFrameError onError = OnFrameError::kContinue;
  const CancelToken& cancel;
};

/// What a job gets: the index of a task, and the number of the worker that does it, from 0.
struct Task {
  std::size_t index = 0;
  int worker = 0;
};

/// Calls a job for each task. The tasks begin in their order; as many as there are workers run at
/// the same time. No task begins after the token is set or, with OnFrameError::kStop, after one
/// failed. Tasks that have begun are completed.
/// \param job  returns false if the task failed; if it throws, the first exception is thrown again
///             after all workers have ended
void forEachTask(const TaskRun& run, const std::function<bool(const Task&)>& job);

/// The indices of the frames that have an input, each of which is a task.
[[nodiscard]] std::vector<std::size_t> framesWithInput(const std::vector<Frame>& frames);

/// The number of tasks that run at the same time on the CPU: one for each thread.
/// \param threads  value of --threads; 0: as many as the machine has
[[nodiscard]] int taskWorkers(int threads, std::size_t tasks);

/// Lets tasks on several threads pass one after the other, in the order of their numbers: a task that
/// is done waits until all tasks before it have passed. As many results as there are
/// threads therefore wait at the same time, however many tasks there are. Every task must either
/// pass or close the turnstile.
class Turnstile {
 public:
  /// Waits for the turn of a task.
  /// \return false if the turnstile is closed, so that the task must not pass
  [[nodiscard]] bool await(std::size_t task);
  /// Gives the turn to the next task.
  void pass();
  /// Lets no further task pass.
  void close();

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::size_t next_ = 0;
  bool closed_ = false;
};

}  // namespace esvr::cli
