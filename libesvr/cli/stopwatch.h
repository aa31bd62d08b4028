#pragma once
/// The time that a run's phases take.

#include <chrono>

namespace esvr::cli {

class Stopwatch {
 public:
  /// Seconds since it was made or last asked for a lap.
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
