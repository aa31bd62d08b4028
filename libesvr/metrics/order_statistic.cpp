#include "metrics/order_statistic.h"

#include <bit>
#include <cmath>
#include <vector>

#include "core/parallel.h"

namespace esvr::metrics {
namespace {

constexpr int kDigitBits = 16;
constexpr int kKeyBits = 64;
constexpr std::size_t kDigits = std::size_t{1} << kDigitBits;
constexpr std::size_t kPairsPerCountingTask = 4096;  // large, since a task's counters take 512 KB

using Histogram = std::vector<std::uint64_t>;

/// The bit pattern of a non-negative value, which has the same order as the values.
std::uint64_t keyOf(double value) { return std::bit_cast<std::uint64_t>(value); }

/// Calls visit(|error|) at every voxel that is active in either volume.
template <class Visit>
void visitErrors(const BrickPair& pair, Visit visit) {
  const PairValues values(pair);
  for (int offset = 0; offset < kBrickVoxels; ++offset)
    if (values.referenceActive(offset) || values.candidateActive(offset))
      visit(std::abs(values.error(offset)));
}

/// The leading bits of the result that are known so far.
struct Prefix {
  std::uint64_t bits = 0;
  int unknown = kKeyBits;  ///< trailing bits still to be found

  [[nodiscard]] bool matches(std::uint64_t key) const {
    return unknown == kKeyBits || (key >> unknown) == bits;
  }
  [[nodiscard]] std::size_t nextDigit(std::uint64_t key) const {
    return std::size_t(key >> (unknown - kDigitBits)) & (kDigits - 1);
  }
  void append(std::size_t digit) {
    bits = bits << kDigitBits | digit;
    unknown -= kDigitBits;
  }
};

Histogram added(Histogram a, const Histogram& b) {
  for (std::size_t i = 0; i < kDigits; ++i) a[i] += b[i];
  return a;
}

Histogram countDigits(std::span<const BrickPair> pairs, const Prefix& prefix) {
  using Range = tbb::blocked_range<std::size_t>;
  return parallelReduce(
      Range(0, pairs.size(), kPairsPerCountingTask), Histogram(kDigits),
      [&](const Range& range, Histogram counts) {
        for (std::size_t i = range.begin(); i != range.end(); ++i)
          visitErrors(pairs[i], [&](double error) {
            const std::uint64_t key = keyOf(error);
            if (prefix.matches(key)) ++counts[prefix.nextDigit(key)];
          });
        return counts;
      },
      added);
}

}  // namespace

double errorOfRank(std::span<const BrickPair> pairs, std::uint64_t rank) {
  Prefix prefix;
  while (prefix.unknown > 0) {
    const Histogram counts = countDigits(pairs, prefix);
    std::size_t digit = 0;
    while (counts[digit] < rank) rank -= counts[digit++];
    prefix.append(digit);
  }
  return std::bit_cast<double>(prefix.bits);
}

std::uint64_t nearestRank(std::uint64_t count, std::uint64_t permille) {
  constexpr std::uint64_t kThousand = 1000;
  // ceil(count * permille / 1000) without overflow
  const std::uint64_t whole = count / kThousand * permille;
  const std::uint64_t rest = count % kThousand * permille;
  return whole + (rest + kThousand - 1) / kThousand;
}

}  // namespace esvr::metrics
