#pragma once
/// Cancels long calls.

#include <atomic>
#include <functional>

namespace esvr {

/// A flag that another thread or a signal handler sets to stop a long call at its next safe point.
/// It belongs to the caller.
class CancelToken {
 public:
  void cancel() noexcept { flag_.store(true, std::memory_order_relaxed); }
  [[nodiscard]] bool cancelled() const noexcept { return flag_.load(std::memory_order_relaxed); }

 private:
  std::atomic<bool> flag_{false};
  static_assert(std::atomic<bool>::is_always_lock_free, "cancel() is called from signal handlers");
};

}  // namespace esvr
