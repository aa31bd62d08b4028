#include "cli/turnstile.h"

namespace esvr::cli {

bool Turnstile::await(std::size_t task) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return closed_ || next_ == task; });
  return !closed_;
}

void Turnstile::pass() {
  const std::lock_guard lock(mutex_);
  ++next_;
  changed_.notify_all();
}

void Turnstile::close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  changed_.notify_all();
}

}  // namespace esvr::cli
