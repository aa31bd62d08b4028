#pragma once
/// How a program runs and ends: errors and exit codes, Ctrl-C, and the times of its phases.

#include <atomic>
#include <chrono>
#include <csignal>
#include <functional>
#include <string>
#include <thread>

#include "esvr/device.h"
#include "esvr/error.h"

namespace esvr::cli {

/// Runs a program's body. If it throws, prints "NAME: text" to stderr and returns the exit code:
/// Error::exitCode(), 5 if memory ran out, and 1 for any other error or if stdout is not writable.
/// \param body  returns the exit code of a run that does not throw
int runMain(const std::string& program, const std::function<int()>& body);

/// The exception that is being handled, as an Error with the kind whose value is the exit code. To
/// be called in a catch clause.
[[nodiscard]] Error currentFailure();

/// Measures the time of a run's phases.
class Stopwatch {
 public:
  /// Seconds since construction or the last call.
  double lap() {
    const auto now = Clock::now();
    const std::chrono::duration<double> passed = now - start_;
    start_ = now;
    return passed.count();
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_ = Clock::now();
};

// Ctrl-C (SIGINT) and SIGTERM.

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
