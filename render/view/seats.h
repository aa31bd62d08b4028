#pragma once
/// Counts what exists at a time.

#include <cstddef>
#include <memory>

namespace esvr::view {

/// A number of seats. They are taken and left on one thread.
class Seats {
 public:
  explicit Seats(std::size_t count) : free_(std::make_shared<std::size_t>(count)) {}

  /// A seat that is left when the last copy of the result is destroyed; null if there is none.
  [[nodiscard]] std::shared_ptr<void> take() {
    if (*free_ == 0) return nullptr;
    --*free_;
    return {free_.get(), [free = free_](void*) { ++*free; }};
  }

 private:
  std::shared_ptr<std::size_t> free_;
};

}  // namespace esvr::view
