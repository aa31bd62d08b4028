#pragma once
/// Codes differences from predictions. How large a difference is expected follows from the ones
/// before.

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "codec/symbol_coder.h"
#include "esvr/error.h"

namespace esvr::codec {

/// A running mean of magnitudes. They are given in units that do not depend on the number of bits of
/// a code, so that codes of different precision share it.
class ExpectedMagnitude {
 public:
  explicit ExpectedMagnitude(std::uint64_t first) : mean_(first) {}

  [[nodiscard]] std::uint64_t mean() const { return mean_; }

  void learn(std::uint64_t magnitude) {
    mean_ = (mean_ * (kMemory - 1) + std::min(magnitude, kLargest) + kMemory / 2) / kMemory;
  }

 private:
  static constexpr std::uint64_t kMemory = 32, kLargest = std::uint64_t{1} << 40;
  std::uint64_t mean_;
};

/// Codes signed numbers with models for each octave of their expected magnitude.
class DifferenceModel {
 public:
  static constexpr std::size_t kContexts = 12, kActivities = 4;

  /// \param quarters  expected magnitude in quarters of one
  [[nodiscard]] static std::size_t contextOf(std::uint64_t quarters) {
    return std::min(std::size_t(std::bit_width(quarters)), kContexts - 1);
  }

  /// \param activity  a further context of whether the number is 0, below kActivities
  template <class Side>
  std::int64_t code(Side& side, std::size_t context, std::size_t activity,
                    std::int64_t difference) {
    if (!side.bit(differs_[context][activity], difference != 0)) return 0;
    const bool negative = side.bit(sign_[context], difference < 0);
    const std::uint64_t magnitude =
        codeMagnitude(side, context, std::uint64_t(std::abs(difference)));
    if (magnitude > kMaxDifference) throw BadInput("a difference is larger than can be");
    return negative ? -std::int64_t(magnitude) : std::int64_t(magnitude);
  }

 private:
  static constexpr std::uint64_t kUnary = 3;  // flags of a magnitude before its rest
  static constexpr std::uint64_t kMaxDifference = std::uint64_t{1} << 36;

  /// Codes a number above 0: whether it is above 1, above 2, ..., and the rest.
  template <class Side>
  std::uint64_t codeMagnitude(Side& side, std::size_t context, std::uint64_t magnitude) {
    for (std::uint64_t n = 1; n <= kUnary; ++n)
      if (!side.bit(above_[context][n - 1], magnitude > n)) return n;
    return kUnary + 1 + rest_[context].code(side, magnitude - kUnary - 1);
  }

  std::array<std::array<BitModel, kActivities>, kContexts> differs_;
  std::array<BitModel, kContexts> sign_;
  std::array<std::array<BitModel, kUnary>, kContexts> above_;
  std::array<NumberModelOf<6>, kContexts> rest_;
};

}  // namespace esvr::codec
