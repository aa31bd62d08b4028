#include "fit/chunks/divide_count.h"

#include <algorithm>
#include <cmath>

#include "esvr/fit.h"

namespace esvr {
namespace {

/// The error falls as n^-p.
const double kPower = 0.1 * kDbPerDoubling / std::log10(2.0);

/// A number to which the best number of ellipsoids is proportional. With E = a n^-p, dE/dn is the
/// same for all chunks if n is proportional to a^(1 / (p + 1)).
double weightOf(const ChunkNeed& need) {
  const double a = need.error * std::pow(need.count, kPower);
  return std::pow(a, 1.0 / (kPower + 1.0));
}

std::size_t within(const ChunkNeed& need, double number) {
  const double bounded = std::clamp(number, double(need.least), double(need.most));
  return std::size_t(std::floor(bounded));
}

/// The numbers at a factor of the weights, within the limits.
std::vector<std::size_t> numbersAt(double factor, std::span<const ChunkNeed> needs) {
  std::vector<std::size_t> numbers;
  for (const ChunkNeed& need : needs) numbers.push_back(within(need, factor * weightOf(need)));
  return numbers;
}

std::size_t sumOf(std::span<const std::size_t> numbers) {
  std::size_t sum = 0;
  for (const std::size_t n : numbers) sum += n;
  return sum;
}

}  // namespace

std::vector<std::size_t> dividedCount(std::size_t count, std::span<const ChunkNeed> needs) {
  double low = 0.0, high = 0.0;  // factors of the weights
  for (const ChunkNeed& need : needs)
    if (const double weight = weightOf(need); weight > 0.0)
      high = std::max(high, double(count) / weight);
  constexpr int kHalvings = 60;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (sumOf(numbersAt(middle, needs)) <= count ? low : high) = middle;
  }
  std::vector<std::size_t> numbers = numbersAt(low, needs);
  // Rounding down leaves less than one ellipsoid a chunk.
  std::size_t left = count - std::min(count, sumOf(numbers));
  for (std::size_t c = 0; c < needs.size() && left > 0; ++c) {
    if (numbers[c] >= needs[c].most || !(needs[c].error > 0.0)) continue;
    ++numbers[c];
    --left;
  }
  return numbers;
}

}  // namespace esvr
