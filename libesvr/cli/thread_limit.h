#pragma once
/// The option --threads.

#include <memory>

namespace esvr::cli {

/// While it exists, parallel loops use at most `threads` threads; 0 sets no limit.
class ThreadLimit {
 public:
  explicit ThreadLimit(int threads);
  ~ThreadLimit();
  ThreadLimit(const ThreadLimit&) = delete;
  ThreadLimit& operator=(const ThreadLimit&) = delete;

 private:
  struct Control;
  std::unique_ptr<Control> control_;
};

}  // namespace esvr::cli
