#pragma once
/// Counts what exists at a time.

#include <algorithm>
#include <cstddef>
#include <deque>
#include <memory>
#include <utility>

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

/// The guests that are there at a time. A further one takes the place of the one that came first, so
/// that guests who only wait keep nobody out.
/// \tparam Guest  has isGuest(), and drop(), which ends it
template <class Guest>
class Guests {
 public:
  explicit Guests(std::size_t most) : most_(most) {}

  void admit(const std::shared_ptr<Guest>& guest) {
    std::erase_if(guests_, [](const std::weak_ptr<Guest>& g) {
      const auto there = g.lock();
      return !there || !there->isGuest();
    });
    if (guests_.size() >= most_ && !guests_.empty()) {
      if (const auto first = guests_.front().lock()) first->drop();
      guests_.pop_front();
    }
    guests_.push_back(guest);
  }

 private:
  std::size_t most_;
  std::deque<std::weak_ptr<Guest>> guests_;  ///< the one that came first is the first
};

}  // namespace esvr::view
