#pragma once
/// A CUDA event that measures time and is released with its owner.

#include <cuda_runtime_api.h>

#include "core/cuda/check.h"

namespace esvr::cuda {

class Event {
 public:
  Event() { check(cudaEventCreate(&event_), "making an event"); }
  Event(const Event&) = delete;
  Event& operator=(const Event&) = delete;
  ~Event() { cudaEventDestroy(event_); }

  void record(cudaStream_t stream) { check(cudaEventRecord(event_, stream), "recording an event"); }

  /// Time from `start` to this event. The call waits until both have happened.
  [[nodiscard]] double millisecondsSince(const Event& start) const {
    check(cudaEventSynchronize(event_), "waiting for an event");
    float milliseconds = 0.0f;
    check(cudaEventElapsedTime(&milliseconds, start.event_, event_), "reading a time");
    return double(milliseconds);
  }

 private:
  cudaEvent_t event_ = nullptr;
};

}  // namespace esvr::cuda
