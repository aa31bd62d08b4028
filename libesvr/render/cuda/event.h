#pragma once
/// Ownership of a CUDA event, for times.

#include "core/cuda/check.h"

namespace esvr::cuda {

class Event {
 public:
  Event() { check(cudaEventCreate(&event_), "making an event"); }
  Event(const Event&) = delete;
  Event& operator=(const Event&) = delete;
  ~Event() { cudaEventDestroy(event_); }

  void record(cudaStream_t stream) { check(cudaEventRecord(event_, stream), "recording an event"); }
  /// Milliseconds since an earlier one; both have passed.
  [[nodiscard]] double since(const Event& earlier) const {
    float ms = 0.0f;
    check(cudaEventElapsedTime(&ms, earlier.event_, event_), "reading a time");
    return double(ms);
  }

 private:
  cudaEvent_t event_ = nullptr;
};

}  // namespace esvr::cuda
