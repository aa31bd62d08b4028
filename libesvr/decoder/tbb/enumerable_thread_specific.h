#pragma once
/// The values of all threads, of which there is one (blocked_range.h).

#include <array>

namespace tbb {

template <class Value>
class enumerable_thread_specific {
 public:
  [[nodiscard]] Value& local() { return values_[0]; }
  [[nodiscard]] auto begin() const { return values_.begin(); }
  [[nodiscard]] auto end() const { return values_.end(); }

 private:
  std::array<Value, 1> values_{};
};

}  // namespace tbb
