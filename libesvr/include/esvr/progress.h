#pragma once
/// Cancels long calls.

#include <atomic>
#include <functional>

namespace esvr {

/// A flag that another thread or a signal handler sets to stop a long call at its next safe point.
/// It belongs to the caller.
class CancelToken {
 public:
  CancelToken() = default;
  /// A token for a part of a call. \param whole  the token of the call, which cancels this part too;
  ///                                             it may be null and must outlive this one
  explicit CancelToken(const CancelToken* whole) : whole_(whole) {}

  void cancel() noexcept { flag_.store(true, std::memory_order_relaxed); }
  [[nodiscard]] bool cancelled() const noexcept {
    return flag_.load(std::memory_order_relaxed) || (whole_ && whole_->cancelled());
  }

 private:
  const CancelToken* whole_ = nullptr;
  std::atomic<bool> flag_{false};
  static_assert(std::atomic<bool>::is_always_lock_free, "cancel() is called from signal handlers");
};

}  // namespace esvr
