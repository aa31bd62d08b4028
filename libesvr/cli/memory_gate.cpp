#include "cli/memory_gate.h"

#include <algorithm>

namespace esvr::cli {

MemoryGate::Part MemoryGate::take(std::uint64_t bytes) {
  const std::uint64_t wanted = std::min(bytes, all_);
  std::unique_lock lock(mutex_);
  const std::uint64_t ticket = nextTicket_++;
  changed_.wait(lock, [&] { return ticket == served_ && wanted <= all_ - taken_; });
  ++served_;
  taken_ += wanted;
  changed_.notify_all();
  return {*this, wanted};
}

void MemoryGate::giveBack(std::uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  taken_ -= bytes;
  changed_.notify_all();
}

}  // namespace esvr::cli
