#include "cli/interrupts.h"

#include <atomic>
#include <stdexcept>

namespace esvr::cli {
namespace {

std::atomic<CancelToken*> signalled{nullptr};
static_assert(std::atomic<CancelToken*>::is_always_lock_free, "read by a signal handler");

extern "C" void cancelSignalled(int) {
  if (CancelToken* token = signalled.load()) token->cancel();
}

}  // namespace

Interrupts::Interrupts() {
  CancelToken* none = nullptr;
  if (!signalled.compare_exchange_strong(none, &token_))
    throw std::logic_error("two cli::Interrupts at a time");
  struct sigaction action {};
  action.sa_handler = cancelSignalled;
  action.sa_flags = int(SA_RESETHAND) | SA_RESTART;
  sigaction(SIGINT, &action, &previousInt_);
  sigaction(SIGTERM, &action, &previousTerm_);
}

Interrupts::~Interrupts() {
  sigaction(SIGINT, &previousInt_, nullptr);
  sigaction(SIGTERM, &previousTerm_, nullptr);
  signalled.store(nullptr);
}

}  // namespace esvr::cli
