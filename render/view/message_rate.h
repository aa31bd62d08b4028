#pragma once
/// Limits how often something happens.

#include <algorithm>
#include <chrono>
#include <optional>

namespace esvr::view {

/// A bucket of tokens: each event takes one, and they come back at a constant rate.
class MessageRate {
 public:
  using Clock = std::chrono::steady_clock;

  MessageRate(double perSecond, double burst)
      : perSecond_(perSecond), burst_(burst), left_(burst) {}

  /// Counts an event. \return how long the next one has to wait
  [[nodiscard]] Clock::duration count(Clock::time_point now) {
    const std::chrono::duration<double> passed = now - last_.value_or(now);
    last_ = now;
    left_ = std::min(burst_, left_ + passed.count() * perSecond_) - 1.0;
    const std::chrono::duration<double> wait(std::max(0.0, -left_ / perSecond_));
    return std::chrono::duration_cast<Clock::duration>(wait);
  }

 private:
  double perSecond_, burst_, left_;
  std::optional<Clock::time_point> last_;
};

}  // namespace esvr::view
