#pragma once
/// Chooses a code by its error and its bits.

#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "codec/symbol_coder.h"

namespace esvr::codec {

/// The code with the least cost, which is the square of its error plus its bits times their price:
/// the one nearest to the exact value, the next one towards the guess, or the guess itself.
/// \param codeIt  codeIt(meter, code) measures the bits of a code
template <class CodeIt>
[[nodiscard]] std::int64_t thriftyCode(double exact, std::int64_t guess, double bitPrice,
                                       const CodeIt& codeIt) {
  constexpr double kFarthestGuess = 4.0;  // steps up to which the guess itself is considered
  const auto nearest = std::int64_t(std::llround(exact));
  if (bitPrice <= 0.0 || guess == nearest) return nearest;
  std::int64_t best = nearest;
  double least = HUGE_VAL;
  const auto consider = [&](std::int64_t code) {
    BitMeter meter;
    codeIt(meter, code);
    const double error = double(code) - exact;
    const double cost = error * error + bitPrice * meter.bits;
    if (cost < least) least = cost, best = code;
  };
  const std::int64_t step = guess > nearest ? 1 : -1;
  consider(nearest);
  if (nearest + step != guess) consider(nearest + step);
  if (std::abs(double(guess) - exact) < kFarthestGuess) consider(guess);
  return best;
}

}  // namespace esvr::codec
