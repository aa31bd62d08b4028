#pragma once
/// Parts that take no time.

#include <atomic>
#include <functional>
#include <utility>
#include <vector>

#include "esvr/fit.h"

namespace esvr::test {

inline PartKey keyOfPart(std::size_t part) { return {part, 7}; }

/// The result of part p is p + 1 bytes of the value p.
inline std::vector<std::byte> resultOfPart(std::size_t part) {
  return std::vector<std::byte>(part + 1, std::byte(part));
}

class FakeParts : public RoundParts {
 public:
  /// \param during  is called by each fit
  explicit FakeParts(std::size_t count, std::function<void(std::size_t)> during = {})
      : fits_(count), during_(std::move(during)) {}

  [[nodiscard]] int round() const override { return 2; }
  [[nodiscard]] std::size_t count() const override { return fits_.size(); }
  [[nodiscard]] PartKey keyOf(std::size_t part) const override { return keyOfPart(part); }
  [[nodiscard]] PartOutput fit(std::size_t part, const Device&) const override {
    ++fits_[part];
    if (during_) during_(part);
    return {resultOfPart(part), complete};
  }
  /// The number of fits of each part.
  [[nodiscard]] std::vector<int> fits() const { return {fits_.begin(), fits_.end()}; }

  bool complete = true;

 private:
  mutable std::vector<std::atomic<int>> fits_;
  std::function<void(std::size_t)> during_;
};

inline std::vector<std::vector<std::byte>> resultsOfParts(std::size_t count) {
  std::vector<std::vector<std::byte>> results;
  for (std::size_t p = 0; p < count; ++p) results.push_back(resultOfPart(p));
  return results;
}

}  // namespace esvr::test
