#pragma once
/// Converts the frames of a sequence, or does other tasks, on several threads.

#include <cstddef>
#include <functional>
#include <vector>

#include "cli/sequence.h"
#include "esvr/progress.h"

namespace esvr::cli {

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

struct FrameRun {
  const std::vector<Frame>& frames;
  int workers = 1;
  OnFrameError onError = OnFrameError::kContinue;
  const CancelToken& cancel;
};

/// What a job gets: the index of a frame, and the number of the worker that converts it, from 0.
struct FrameTask {
  std::size_t frame = 0;
  int worker = 0;
};

/// Calls a job for each frame that has an input, as forEachTask does.
void forEachFrame(const FrameRun& run, const std::function<bool(const FrameTask&)>& job);

/// The number of frames that have an input.
[[nodiscard]] std::size_t countWithInput(const std::vector<Frame>& frames);

/// The number of frames that are converted at the same time on the CPU: one for each thread.
/// \param threads  value of --threads; 0: as many as the machine has
[[nodiscard]] int frameWorkers(int threads, const std::vector<Frame>& frames);

/// The same for any tasks.
[[nodiscard]] int taskWorkers(int threads, std::size_t tasks);

}  // namespace esvr::cli
