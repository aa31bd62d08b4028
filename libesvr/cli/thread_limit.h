#pragma once
/// --threads.

#include <memory>

namespace esvr::cli {

/// As long as it lives, parallel loops use `threads` threads at most; 0 sets no limit.
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
