#pragma once
/// Measures the time of a run's phases.

#include <chrono>

namespace esvr::cli {

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

}  // namespace esvr::cli
