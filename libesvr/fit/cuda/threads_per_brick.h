#pragma once
/// How many threads work on one brick: few keep more bricks going at once, many are done sooner
/// with a full one. Which is better depends on the scene and the device, so a run measures it now
/// and then. The choice changes no bit of what is computed.

#include <array>

#include "core/cuda/event.h"

namespace esvr::cuda {

class ThreadsPerBrick {
 public:
  static constexpr int kChoices = 3;
  static constexpr int threads(int choice) { return 128 << choice; }

  /// Calls pass(threads), which starts a pass on the stream, with the best threads or, while a
  /// measurement is going on, with the next to be tried.
  template <class Pass>
  void run(cudaStream_t stream, const Pass& pass) {
    if (tried_ == kChoices) return pass(threads(best_));
    Trial& trial = trials_[std::size_t(tried_)];
    trial.begin.record(stream);
    pass(threads(tried_++));
    trial.end.record(stream);
  }

  /// To be called where the host waits for the stream anyway, once new lists have been built: takes
  /// the best of what was measured, and begins anew when it has served for long enough.
  /// \param passes  calls of run() since the call before that did work; those after them were halted
  ///                (halt.h) and took no time
  void listsChanged(std::size_t passes);

 private:
  struct Trial {
    Event begin, end;
  };
  std::array<Trial, kChoices> trials_;
  int tried_ = 0;        ///< choices of the measurement that is going on
  int triedBefore_ = 0;  ///< those on the lists before
  int best_ = 1;
  bool measuring_ = true;
  std::size_t served_ = 0;  ///< passes since the last measurement
};

}  // namespace esvr::cuda
