#pragma once
/// Memory that a reader may use for what a file asks for.

#include <cstdint>
#include <string>

#include "esvr/memory_limit.h"

namespace esvr {

class MemoryBudget {
 public:
  explicit MemoryBudget(std::uint64_t maxBytes) : max_(maxBytes) {}

  /// Takes memory before it is allocated. \param what  begins the message
  /// \throws MemoryExceeded  more is taken than there is
  void take(double bytes, const std::string& what) {
    taken_ += bytes;
    requireWithinMemory(taken_, max_, what);
  }

 private:
  std::uint64_t max_;
  double taken_ = 0.0;
};

}  // namespace esvr
