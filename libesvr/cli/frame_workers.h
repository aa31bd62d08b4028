#pragma once
/// Converts the frames of a sequence on several threads.

#include <cstddef>
#include <functional>
#include <vector>

#include "cli/sequence.h"
#include "esvr/progress.h"

namespace esvr::cli {

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

/// Calls a job for each frame that has an input. The frames begin in their order; as many as there
/// are workers run at the same time. No frame begins after the token is set or, with
/// OnFrameError::kStop, after one failed. Frames that have begun are completed.
/// \param job  returns false if the frame failed; if it throws, the first exception is thrown again
///             after all workers have ended
void forEachFrame(const FrameRun& run, const std::function<bool(const FrameTask&)>& job);

/// The number of frames that are converted at the same time on the CPU: one for each thread.
/// \param threads  value of --threads; 0: as many as the machine has
[[nodiscard]] int frameWorkers(int threads, const std::vector<Frame>& frames);

}  // namespace esvr::cli
