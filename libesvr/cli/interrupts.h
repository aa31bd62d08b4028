#pragma once
/// Handles Ctrl-C.

#include <csignal>

#include "esvr/progress.h"

namespace esvr::cli {

/// While it exists, the first SIGINT or SIGTERM sets the token instead of ending the process, so
/// that a run can stop at a safe point. The second one ends the process. Only one object may exist
/// at a time, because a signal handler can find its token only through a static pointer.
class Interrupts {
 public:
  Interrupts();
  ~Interrupts();
  Interrupts(const Interrupts&) = delete;
  Interrupts& operator=(const Interrupts&) = delete;

  [[nodiscard]] const CancelToken& token() const { return token_; }

 private:
  CancelToken token_;
  struct sigaction previousInt_ {
  }, previousTerm_{};
};

}  // namespace esvr::cli
