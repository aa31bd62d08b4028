#pragma once
/// A limit on the memory that a reader takes for the content of a file.

#include <cstdint>
#include <string>

#include "esvr/memory_limit.h"

namespace esvr {

class MemoryBudget {
 public:
  explicit MemoryBudget(std::uint64_t maxBytes) : max_(maxBytes) {}

  /// Takes bytes from the budget, before they are allocated.
  /// \param what  start of the message
  /// \throws MemoryExceeded  the budget has fewer bytes
  void take(double bytes, const std::string& what) {
    taken_ += bytes;
    requireWithinMemory(taken_, max_, what);
  }

 private:
  std::uint64_t max_;
  double taken_ = 0.0;
};

}  // namespace esvr
