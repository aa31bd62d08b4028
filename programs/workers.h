#pragma once
/// The threads of a program: the option --threads, frames and other tasks on several threads, and the
/// order of their results.

#include <condition_variable>
#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>
#include <vector>

#include "esvr/device.h"
#include "programs/sequence.h"

namespace esvr::cli {

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
