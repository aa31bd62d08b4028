#pragma once
/// Counts the bytes requested from operator new, which shows how much memory a hostile file makes a
/// reader take.

#include <cstddef>

namespace esvr::test {

/// Bytes requested by this thread since the meter was made. Freed memory is not subtracted.
class AllocationMeter {
 public:
  AllocationMeter();
  [[nodiscard]] std::size_t bytes() const;

 private:
  std::size_t start_;
};

}  // namespace esvr::test
