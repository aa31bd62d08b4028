#pragma once
/// The pool that stream-ordered allocations of a device come from.

#include <cstddef>

namespace esvr::cuda {

/// Keeps freed memory of the current device in its pool as long as one of these lives: a fit
/// allocates anew at every event, and would else give the memory back and ask for it again at every
/// synchronisation. The last one restores the setting that the first one found.
class KeepFreedMemory {
 public:
  KeepFreedMemory();
  KeepFreedMemory(const KeepFreedMemory&) = delete;
  KeepFreedMemory& operator=(const KeepFreedMemory&) = delete;
  ~KeepFreedMemory();

 private:
  int device_ = 0;
};

/// Gives back to the device what the current device's pool holds and no buffer uses. Waits for all
/// that was put on the device's streams before.
void trimMemoryPool();

/// \return bytes that the current device has left, and those that its pool holds, in use or not
[[nodiscard]] std::size_t availableMemory();

/// \return the most bytes that the current device's pool has handed out since the last call of
///         forgetPeakMemory()
[[nodiscard]] std::size_t peakMemory();
void forgetPeakMemory();

}  // namespace esvr::cuda
