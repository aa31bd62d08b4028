#pragma once
/// Lets tasks on several threads pass one after the other, in the order of their numbers.

#include <condition_variable>
#include <cstddef>
#include <mutex>

namespace esvr::cli {

/// A task that is done waits until all tasks before it have passed. As many results as there are
/// threads therefore wait at the same time, however many tasks there are. Every task must either
/// pass or close the turnstile.
class Turnstile {
 public:
  /// Waits for the turn of a task.
  /// \return false if the turnstile is closed, so that the task must not pass
  [[nodiscard]] bool await(std::size_t task);
  /// Gives the turn to the next task.
  void pass();
  /// Lets no further task pass.
  void close();

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::size_t next_ = 0;
  bool closed_ = false;
};

}  // namespace esvr::cli
