#pragma once
/// Chooses the number of threads that work on one brick. With few threads more bricks are in work
/// at the same time; with many threads a brick with a long list is done sooner. The better choice
/// depends on the scene and the device, so a run measures it from time to time. The choice does not
/// change any result.

#include <array>

#include "core/cuda/event.h"

namespace esvr::cuda {

class ThreadsPerBrick {
 public:
  static constexpr int kChoices = 3;
  static constexpr int threads(int choice) { return 128 << choice; }

  /// Calls pass(threads), which starts a pass on the stream, with the best number of threads.
  /// During a measurement it tries the next number instead.
  template <class Pass>
  void run(cudaStream_t stream, const Pass& pass) {
    if (tried_ == kChoices) return pass(threads(best_));
    Trial& trial = trials_[std::size_t(tried_)];
    trial.begin.record(stream);
    pass(threads(tried_++));
    trial.end.record(stream);
  }

  /// Must be called after new lists have been built, where the host has waited for the stream. It
  /// takes the fastest of the measured numbers, and starts a new measurement after some lists.
  /// \param passes  number of calls of run() since the last call that did work. The calls after
  ///                them were halted (halt.h), so their times are not valid
  void listsChanged(std::size_t passes);

 private:
  struct Trial {
    Event begin, end;
  };
  std::array<Trial, kChoices> trials_;
  int tried_ = 0;        ///< choices that the current measurement has tried
  int triedBefore_ = 0;  ///< value of tried_ at the last call of listsChanged()
  int best_ = 1;
  bool measuring_ = true;
  std::size_t served_ = 0;  ///< passes since the last measurement
};

}  // namespace esvr::cuda
