#pragma once
/// A function that remembers its latest results.

#include <array>
#include <bit>
#include <cstdint>
#include <type_traits>
#include <utility>

namespace esvr {

/// A costly function of floats for values that repeat, such as those of neighbouring voxels on a lattice.
template <class Function>
class Remembered {
 public:
  using Value = std::invoke_result_t<Function&, float>;

  explicit Remembered(Function function) : function_(std::move(function)) {
    results_.fill({0, function_(0.0f)});
  }

  Value operator()(float argument) {
    constexpr std::uint32_t kGolden =
        0x9e3779b1;  // 2^32 over the golden ratio spreads the arguments
    const auto bits = std::bit_cast<std::uint32_t>(argument);
    Result& result = results_[(bits * kGolden) >> (32 - kBits)];
    if (result.of != bits) result = {bits, function_(argument)};
    return result.value;
  }

 private:
  static constexpr int kBits = 7;  // the table takes one or two kilobytes
  struct Result {
    std::uint32_t of;  ///< bits of the argument
    Value value;
  };
  Function function_;
  std::array<Result, std::size_t{1} << kBits> results_;
};

}  // namespace esvr
