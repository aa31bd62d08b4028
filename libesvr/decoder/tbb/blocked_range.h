#pragma once
/// The part of oneTBB's interface that the decoder uses, on one thread. The decoder-only build has
/// this folder on its include path in place of oneTBB, so that it compiles the same sources without
/// that library.

#include <cstddef>

namespace tbb {

/// An interval of numbers. It is never divided.
template <class Value>
class blocked_range {
 public:
  blocked_range(Value begin, Value end, std::size_t grain = 1) : begin_(begin), end_(end) {
    (void)grain;
  }
  [[nodiscard]] Value begin() const { return begin_; }
  [[nodiscard]] Value end() const { return end_; }
  [[nodiscard]] bool empty() const { return !(begin_ < end_); }

 private:
  Value begin_, end_;
};

}  // namespace tbb
