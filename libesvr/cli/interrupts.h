#pragma once
/// Ctrl-C.

#include <csignal>

#include "esvr/progress.h"

namespace esvr::cli {

/// As long as it lives, the first SIGINT or SIGTERM sets the token instead of ending the process,
/// so that a run can stop at a safe point; the second ends the process as it would without this.
/// One at a time: a signal handler finds its token through a static pointer, there is no other way.
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
