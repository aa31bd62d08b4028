#pragma once
/// Handles Ctrl-C (SIGINT) and SIGTERM.

#include <atomic>
#include <csignal>
#include <thread>

#include "esvr/progress.h"

namespace esvr::cli {

/// What signals after the first one do.
enum class FurtherSignals {
  kEndAtOnce,  ///< the second one ends the process
  kAreIgnored  ///< for a process that something else kills if it does not end, as mpirun does
};

/// While it exists, the first SIGINT or SIGTERM sets the token instead of ending the process. The token
/// is that of the calling thread (CancelScope), so that all long calls of this thread end soon: with
/// Cancelled, or with the best result so far. Only one object may exist at a time, because a signal
/// handler can find its token only through a static pointer.
///
/// A run that has not ended kSecondsToEnd after the signal is in a call that nothing can end, for
/// example of a library or of a file system that does not answer. Unless a result is being completed
/// (Completion), the process is then ended with exit code 1. Outputs have their names only when they are
/// complete, so that it leaves nothing that a second Ctrl-C would not leave.
class Interrupts {
 public:
  /// Users expect a program to end within two seconds.
  static constexpr double kSecondsToEnd = 1.7;

  explicit Interrupts(FurtherSignals further = FurtherSignals::kEndAtOnce);
  ~Interrupts();
  Interrupts(const Interrupts&) = delete;
  Interrupts& operator=(const Interrupts&) = delete;

  [[nodiscard]] const CancelToken& token() const { return token_; }
  /// See CancelToken::discardResults().
  void discardResults() { token_.discardResults(); }

 private:
  void watch() const;

  CancelToken token_;
  CancelScope scope_{&token_};
  int event_;  ///< an eventfd, to which the handler writes, and the destructor
  std::atomic<bool> ended_{false};
  std::thread watcher_;
  struct sigaction previousInt_ {
  }, previousTerm_{};
};

}  // namespace esvr::cli
