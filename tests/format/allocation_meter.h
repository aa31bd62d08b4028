#pragma once
/// Counts what the program asks of operator new: how much a hostile file can make a reader take.

#include <cstddef>

namespace esvr::test {

/// Bytes asked for by this thread since the meter was made; nothing is taken off for what is freed.
class AllocationMeter {
 public:
  AllocationMeter();
  [[nodiscard]] std::size_t bytes() const;

 private:
  std::size_t start_;
};

}  // namespace esvr::test
