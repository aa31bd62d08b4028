#pragma once
/// Adds up the time that parts of a run take.

#include <chrono>

namespace esvr {

/// Adds the seconds between its construction and its destruction to a sum.
class AddSeconds {
 public:
  explicit AddSeconds(double& sum) : sum_(sum) {}
  ~AddSeconds() { sum_ += std::chrono::duration<double>(Clock::now() - start_).count(); }
  AddSeconds(const AddSeconds&) = delete;
  AddSeconds& operator=(const AddSeconds&) = delete;

 private:
  using Clock = std::chrono::steady_clock;
  double& sum_;
  Clock::time_point start_ = Clock::now();
};

/// The result of `work`, whose seconds are added to a sum. The sum must not be a part of the
/// result.
template <class Work>
decltype(auto) addSeconds(double& sum, const Work& work) {
  const AddSeconds clock(sum);
  return work();
}

/// The seconds that `work` takes.
template <class Work>
[[nodiscard]] double secondsOf(const Work& work) {
  double seconds = 0.0;
  addSeconds(seconds, work);
  return seconds;
}

}  // namespace esvr
