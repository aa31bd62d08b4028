#pragma once
/// Progress and cancellation. Both are handed in by the caller; the library keeps neither.

#include <atomic>
#include <functional>

namespace esvr {

/// Set from another thread or a signal handler to stop a long call at its next safe point.
class CancelToken {
 public:
  void cancel() noexcept { flag_.store(true, std::memory_order_relaxed); }
  [[nodiscard]] bool cancelled() const noexcept { return flag_.load(std::memory_order_relaxed); }

 private:
  std::atomic<bool> flag_{false};
  static_assert(std::atomic<bool>::is_always_lock_free, "cancel() is called from signal handlers");
};

}  // namespace esvr
