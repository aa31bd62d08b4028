#include "fit/cuda/threads_per_brick.h"

#include <algorithm>

namespace esvr::cuda {
namespace {

// Lists between two measurements. A measurement costs about two slower passes out of eighty.
constexpr int kListsServed = 8;

}  // namespace

void ThreadsPerBrick::listsChanged(std::size_t passes) {
  tried_ = int(std::min(std::size_t(tried_), std::size_t(triedBefore_) + passes));
  triedBefore_ = tried_;
  if (tried_ != kChoices) return;
  if (served_ == 0) {
    std::array<double, kChoices> times{};
    for (int k = 0; k < kChoices; ++k)
      times[std::size_t(k)] =
          trials_[std::size_t(k)].end.millisecondsSince(trials_[std::size_t(k)].begin);
    best_ = int(std::min_element(times.begin(), times.end()) - times.begin());
  }
  if (++served_ == kListsServed) served_ = tried_ = triedBefore_ = 0;
}

}  // namespace esvr::cuda
