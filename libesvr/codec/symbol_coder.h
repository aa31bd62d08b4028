#pragma once
/// Codes numbers as decisions of a range coder. The code is the same for both directions: a
/// `Writer` writes a number and returns it, and a `Reader` ignores its argument and returns what
/// was written.

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "codec/range_coder.h"

namespace esvr::codec {

struct Writer {
  RangeEncoder coder;
  bool bit(BitModel& model, bool value) {
    coder.bit(model, value);
    return value;
  }
  std::uint32_t raw(std::uint32_t value, int bits) {
    coder.raw(value, bits);
    return value;
  }
};

/// Measures the bits that decisions would take. Nothing is written and no model learns.
struct BitMeter {
  double bits = 0.0;
  bool bit(const BitModel& model, bool value) {
    const std::uint32_t share = value ? BitModel::kOne - model.zero() : model.zero();
    bits += double(BitModel::kBits) - std::log2(double(share));
    return value;
  }
  std::uint32_t raw(std::uint32_t value, int count) {
    bits += count;
    return value;
  }
};

struct Reader {
  RangeDecoder coder;
  bool bit(BitModel& model, bool) { return coder.bit(model); }
  std::uint32_t raw(std::uint32_t, int bits) { return coder.raw(bits); }
};

/// Codes a number of kBits bits from the highest to the lowest. Each bit has a model for every
/// combination of the bits above it.
template <int kBits>
class TreeModel {
 public:
  template <class Side>
  std::uint32_t code(Side& side, std::uint32_t value) {
    std::uint32_t node = 1;
    for (int b = kBits - 1; b >= 0; --b)
      node = node << 1 | std::uint32_t(side.bit(models_[node], (value >> b) & 1u));
    return node - (1u << kBits);
  }

 private:
  std::array<BitModel, std::size_t{1} << kBits> models_;
};

/// Codes a number of less than 2^kWidthBits bits: first the number of its bits, then the bits below
/// the leading one. The first kModelled of these have models.
template <int kWidthBits>
class NumberModelOf {
 public:
  template <class Side, class Unsigned>
  Unsigned code(Side& side, Unsigned value) {
    const std::uint32_t width = width_.code(side, std::uint32_t(std::bit_width(value)));
    if (width < 2) return width;
    int left = int(width) - 1;
    std::uint32_t top = 1;
    for (int n = 0; n < kModelled && left > 0; ++n)
      top = top << 1 | std::uint32_t(side.bit(bits_[width][top], (value >> --left) & 1u));
    Unsigned result = top;
    for (; left > 0; left -= kRawAtOnce) {
      const int now = std::min(left, kRawAtOnce), below = left - now;
      result = result << now | side.raw(std::uint32_t(value >> below) & ((1u << now) - 1u), now);
    }
    return result;
  }

 private:
  static constexpr int kModelled = 3;
  static constexpr int kRawAtOnce = 2 * kRawBitsAtOnce;  // raw() takes that many bits in a call
  TreeModel<kWidthBits> width_;
  std::array<std::array<BitModel, std::size_t{1} << kModelled>, std::size_t{1} << kWidthBits> bits_;
};

using NumberModel = NumberModelOf<5>;  ///< numbers below 2^31

}  // namespace esvr::codec
