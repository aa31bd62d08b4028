#pragma once
/// The pool from which the stream-ordered allocations of a device take memory.

#include <cstddef>

namespace esvr::cuda {

/// As long as one of these lives, freed memory of the current device stays in its pool. A fit
/// allocates anew at every event; without this, memory would be returned and requested again at
/// every synchronisation. The last one restores the setting that the first one found.
class KeepFreedMemory {
 public:
  KeepFreedMemory();
  KeepFreedMemory(const KeepFreedMemory&) = delete;
  KeepFreedMemory& operator=(const KeepFreedMemory&) = delete;
  ~KeepFreedMemory();

 private:
  int device_ = 0;
};

/// Returns memory of the current device's pool that no buffer uses to the device. It waits for all
/// earlier work on the device's streams.
void trimMemoryPool();

/// \return bytes that are free on the current device, plus those that its pool holds, used or not
[[nodiscard]] std::size_t availableMemory();

}  // namespace esvr::cuda
