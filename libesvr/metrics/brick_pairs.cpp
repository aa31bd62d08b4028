#include "metrics/brick_pairs.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/parallel.h"

namespace esvr::metrics {
namespace {

// The pairs. Two cursors walk over the sorted bricks of both volumes.

/// True if an inactive voxel has the negated background, as inside the surface of a narrow band.
bool hasNegatedBackground(const SparseVolume& volume) {
  if (!(volume.background > 0.0f)) return false;
  for (std::size_t i = 0; i < volume.values.size(); ++i)
    if (volume.values[i] == -volume.background &&
        !volume.active[i / kBrickVoxels].test(int(i % kBrickVoxels)))
      return true;
  return false;
}

/// True if most voxels of the slice of a brick at z have negative values.
bool isSliceNegative(std::span<const float> values, int z) {
  int negative = 0;
  for (int line = z; line < kBrickVoxels; line += kBrickSide) negative += values[line] < 0.0f;
  return 2 * negative > kBrickSide * kBrickSide;
}

/// The bricks of one volume by their positions in index space.
class BrickCursor {
 public:
  explicit BrickCursor(const SparseVolume& volume)
      : volume_(volume),
        origin_(brickOf(volume.origin)),
        narrowBand_(hasNegatedBackground(volume)) {}

  [[nodiscard]] bool done() const { return at_ == volume_.brickCount(); }
  [[nodiscard]] Coord brick() const { return origin_ + volume_.bricks[at_]; }
  [[nodiscard]] bool isAt(Coord place) const { return !done() && brick() == place; }
  [[nodiscard]] const float* values() const { return volume_.brickValues(at_).data(); }
  [[nodiscard]] const BrickMask* active() const { return &volume_.active[at_]; }
  void advance() { ++at_; }

  /// The value at a place without a brick between the brick before and this one. In a narrow band,
  /// the next brick along -z, or else along z, gives the sign with the slice that faces the place.
  /// Without such bricks the place is outside, because a line along z that is inside somewhere
  /// crosses the surface.
  [[nodiscard]] float emptyValue(Coord place) const {
    const bool before = at_ > 0 && isInColumn(at_ - 1, place);
    const bool after = !done() && isInColumn(at_, place);
    bool inside = false;
    if (narrowBand_ && before)
      inside = isSliceNegative(volume_.brickValues(at_ - 1), kBrickSide - 1);
    else if (narrowBand_ && after)
      inside = isSliceNegative(volume_.brickValues(at_), 0);
    return inside ? -volume_.background : volume_.background;
  }

 private:
  [[nodiscard]] bool isInColumn(std::size_t b, Coord place) const {
    const Coord brick = origin_ + volume_.bricks[b];
    return brick.x == place.x && brick.y == place.y;
  }

  const SparseVolume& volume_;
  Coord origin_;
  bool narrowBand_;
  std::size_t at_ = 0;
};

}  // namespace

std::vector<BrickPair> pairBricks(const SparseVolume& reference, const SparseVolume& candidate) {
  BrickCursor a(reference), b(candidate);
  std::vector<BrickPair> pairs;
  pairs.reserve(std::max(reference.brickCount(), candidate.brickCount()));
  while (!a.done() || !b.done()) {
    BrickPair pair;
    pair.brick = a.done() ? b.brick() : (b.done() ? a.brick() : std::min(a.brick(), b.brick()));
    pair.referenceEmpty = a.emptyValue(pair.brick);
    pair.candidateEmpty = b.emptyValue(pair.brick);
    if (a.isAt(pair.brick)) {
      pair.reference = a.values();
      pair.referenceActive = a.active();
      a.advance();
    }
    if (b.isAt(pair.brick)) {
      pair.candidate = b.values();
      pair.candidateActive = b.active();
      b.advance();
    }
    pairs.push_back(pair);
  }
  return pairs;
}

Box localBox(Coord brick, const Box& box) {
  const auto local = [](std::int32_t side, std::int32_t brickSide) {
    const std::int64_t at = std::int64_t(side) - std::int64_t(brickSide) * kBrickSide;
    return std::int32_t(std::clamp<std::int64_t>(at, -1, kBrickSide));
  };
  const auto low = [&](std::int32_t side, std::int32_t brickSide) {
    return std::max(local(side, brickSide), 0);
  };
  const auto high = [&](std::int32_t side, std::int32_t brickSide) {
    return std::min(local(side, brickSide), kBrickSide - 1);
  };
  return {{low(box.min.x, brick.x), low(box.min.y, brick.y), low(box.min.z, brick.z)},
          {high(box.max.x, brick.x), high(box.max.y, brick.y), high(box.max.z, brick.z)}};
}

namespace {

// The order statistic. The bit pattern of a non-negative value has the same order as the values, so
// that the digits of a pattern can be found one after the other.

constexpr int kDigitBits = 16;
constexpr int kKeyBits = 64;
constexpr std::size_t kDigits = std::size_t{1} << kDigitBits;

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

using Range = tbb::blocked_range<std::size_t>;

/// Calls a function with the bits of each error of the union of active voxels that begin with the prefix.
template <class Use>
void forEachKey(std::span<const BrickPair> pairs, const Range& range, const Prefix& prefix,
                const Use& use) {
  for (std::size_t i = range.begin(); i != range.end(); ++i)
    for (int v = 0; v < kBrickVoxels; ++v) {
      if (!pairs[i].isAnyActive(v)) continue;
      const auto key = std::bit_cast<std::uint64_t>(std::abs(pairs[i].errorAt(v)));
      if (prefix.matches(key)) use(key);
    }
}

/// How many errors begin with the prefix, by their next digit.
std::vector<std::uint64_t> countDigits(std::span<const BrickPair> pairs, const Prefix& prefix) {
  using Histogram = std::vector<std::uint64_t>;
  constexpr std::size_t kPairsPerTask = 512;  // large, since a task's counters take 512 KB
  return parallelReduce(
      Range(0, pairs.size(), kPairsPerTask), Histogram(kDigits),
      [&](const Range& range, Histogram counts) {
        forEachKey(pairs, range, prefix,
                   [&](std::uint64_t key) { ++counts[prefix.nextDigit(key)]; });
        return counts;
      },
      [](Histogram a, const Histogram& b) {
        for (std::size_t digit = 0; digit < kDigits; ++digit) a[digit] += b[digit];
        return a;
      });
}

/// All errors that begin with the prefix, in any order.
std::vector<std::uint64_t> keysWith(std::span<const BrickPair> pairs, const Prefix& prefix) {
  return parallelReduce(
      Range(0, pairs.size()), std::vector<std::uint64_t>(),
      [&](const Range& range, std::vector<std::uint64_t> keys) {
        forEachKey(pairs, range, prefix, [&](std::uint64_t key) { keys.push_back(key); });
        return keys;
      },
      [](std::vector<std::uint64_t> a, const std::vector<std::uint64_t>& b) {
        a.insert(a.end(), b.begin(), b.end());
        return a;
      });
}

}  // namespace

double errorOfRank(std::span<const BrickPair> pairs, std::uint64_t rank) {
  constexpr std::uint64_t kFew = std::uint64_t{1} << 18;  // keys that are sorted at once
  Prefix prefix;
  while (prefix.unknown > 0) {
    const std::vector<std::uint64_t> counts = countDigits(pairs, prefix);
    std::size_t digit = 0;
    while (counts[digit] < rank) rank -= counts[digit++];
    prefix.append(digit);
    if (counts[digit] > kFew) continue;
    std::vector<std::uint64_t> keys = keysWith(pairs, prefix);
    const auto at = keys.begin() + std::ptrdiff_t(rank - 1);
    std::nth_element(keys.begin(), at, keys.end());
    return std::bit_cast<double>(*at);
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
