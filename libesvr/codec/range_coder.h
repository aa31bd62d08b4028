#pragma once
/// The entropy coder of all sections but voxels (codec/symbol_coder.h): an adaptive binary range coder, and the models of
/// numbers on top of it.
///
/// Each decision has a model that learns its probability. Only integers are used, so that every machine reads the
/// same (docs/format.md, "The range coder"). Coders of numbers, bricks and voxels are written once for both
/// directions: they are templates of a side, which is a Writer or a Reader. A Writer writes a number and returns it,
/// and a Reader ignores its argument and returns what was written.

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace esvr::codec {

/// All bits set if a condition holds, none otherwise.
inline std::uint32_t allBits(bool condition) { return 0u - std::uint32_t(condition); }

/// Learns the probability of a zero. Decision number n, counted from 0, moves it towards 0 or 1 by
/// 1/(n + 1.5) of the distance. From n = kMemory - 1 on, that share stays the same.
class BitModel {
 public:
  /// Steps are rounded down, so that the probability of the rarer decision does not fall below about
  /// kMemory/kOne. A decision that is always the same then costs 0.000035 bits.
  static constexpr int kBits = 22;
  static constexpr std::uint32_t kOne = 1u << kBits;

  BitModel() = default;

  /// A model that has a probability before the first decision.
  /// \param zeros      share of zeros in units of 1/256, from 1 to 255
  /// \param decisions  number of decisions that the share counts as, below kMemory
  BitModel(std::uint32_t zeros, std::uint32_t decisions)
      : state_(zeros << (kBits - 8) << kCountBits | decisions) {}

  /// True before the first decision.
  [[nodiscard]] bool isNew() const { return (state_ & kCountMask) == 0; }

  /// The probability of a zero in units of 1/kOne. It is neither 0 nor 1.
  [[nodiscard]] std::uint32_t zero() const { return state_ >> kCountBits; }

  /// The part of a range that stands for a zero.
  [[nodiscard]] std::uint32_t part(std::uint32_t range) const {
    return std::uint32_t((std::uint64_t(range) * zero()) >> kBits);
  }

  /// No branch depends on the decision, because processors can hardly foresee it. The probability
  /// moves by a share of its distance from 0 or from kOne - 1. The distance from 0 is the
  /// probability itself, and the distance from kOne - 1 is the probability with inverted bits. A
  /// step is shorter than the distance, so the probability becomes neither 0 nor 1.
  /// \param isZero  allBits() of whether the decision is a zero
  void learn(std::uint32_t isZero) {
    const std::uint32_t count = state_ & kCountMask, inverted = isZero >> kCountBits;
    const std::uint32_t distance = zero() ^ inverted;
    const auto step = std::uint32_t((std::uint64_t(distance) * kShares[count]) >> kShareBits);
    state_ = ((distance - step) ^ inverted) << kCountBits | (count + (count < kMemory - 1 ? 1 : 0));
  }

 private:
  static constexpr int kCountBits = 32 - kBits, kShareBits = 16;
  static constexpr std::uint32_t kCountMask = (1u << kCountBits) - 1;
  /// Decisions until the share stays the same. A smaller number is better for regular volumes, a
  /// larger one for noise (docs/lab-notes.md, "Voxel coding").
  static constexpr std::uint32_t kMemory = 100;
  static constexpr std::array<std::uint16_t, kMemory> kShares = [] {
    std::array<std::uint16_t, kMemory> shares{};
    for (std::uint32_t n = 0; n < kMemory; ++n)
      shares[n] = std::uint16_t((2u << kShareBits) / (2 * n + 3));
    return shares;
  }();

  /// The probability and, in the lowest bits, the number of decisions so far. 4 bytes, so that the
  /// models of a coder of voxels stay in the cache.
  std::uint32_t state_ = 1u << 31;
};

/// Raw bits that are coded as one number. A range is at least 2^24, so that rounding it down to a
/// multiple of 2^12 costs at most 2^-12 of it, or 0.0004 bits.
constexpr int kRawBitsAtOnce = 12;

/// Writes decisions.
class RangeEncoder {
 public:
  void bit(BitModel& model, bool value) {
    const std::uint32_t bound = model.part(range_);
    if (value) {
      low_ += bound;
      range_ -= bound;
    } else {
      range_ = bound;
    }
    model.learn(allBits(!value));
    normalise();
  }

  /// Codes the lowest `bits` bits of a value, the highest first, without models.
  void raw(std::uint32_t value, int bits) {
    while (bits > 0) {
      const int now = std::min(bits, kRawBitsAtOnce);
      bits -= now;
      range_ >>= now;
      low_ += std::uint64_t(range_) * ((value >> bits) & ((1u << now) - 1u));
      normalise();
    }
  }

  /// The number of bytes so far. finish() would now return at most 4 more.
  [[nodiscard]] std::uint64_t size() const { return bytes_.size() + waiting_ - 1; }

  /// Returns the encoded bytes. Zeros at the end are left out, since a decoder reads zeros there.
  [[nodiscard]] std::vector<std::byte> finish() {
    for (int i = 0; i < 5; ++i) shiftLow();
    bytes_.erase(bytes_.begin());  // the first byte is always 0
    while (!bytes_.empty() && bytes_.back() == std::byte{}) bytes_.pop_back();
    return std::move(bytes_);
  }

 private:
  void normalise() {
    while (range_ < (1u << 24)) {
      range_ <<= 8;
      shiftLow();
    }
  }

  /// Outputs the top byte of `low_`. Bytes that a later carry could still change are held back.
  void shiftLow() {
    if (low_ < 0xff000000u || low_ > 0xffffffffu) {
      const auto carry = std::uint32_t(low_ >> 32);
      for (; waiting_ > 0; --waiting_) {
        bytes_.push_back(std::byte((pending_ + carry) & 0xffu));
        pending_ = 0xff;
      }
      pending_ = std::uint32_t(low_ >> 24) & 0xffu;
    }
    ++waiting_;
    low_ = (low_ & 0x00ffffffu) << 8;
  }

  std::uint64_t low_ = 0;
  std::uint32_t range_ = 0xffffffffu;
  std::uint32_t pending_ = 0;
  std::uint64_t waiting_ = 1;
  std::vector<std::byte> bytes_;
};

/// Reads the decisions of a RangeEncoder with the same models.
class RangeDecoder {
 public:
  explicit RangeDecoder(std::span<const std::byte> bytes) : bytes_(bytes) {
    for (int i = 0; i < 4; ++i) code_ = code_ << 8 | next();
  }

  [[nodiscard]] bool bit(BitModel& model) {
    const std::uint32_t bound = model.part(range_), rest = range_ - bound;
    const std::uint32_t zero = allBits(code_ < bound);
    code_ -= bound & ~zero;
    range_ = rest ^ ((rest ^ bound) & zero);
    model.learn(zero);
    normalise();
    return zero == 0;
  }

  [[nodiscard]] std::uint32_t raw(int bits) {
    std::uint32_t value = 0;
    while (bits > 0) {
      const int now = std::min(bits, kRawBitsAtOnce);
      bits -= now;
      range_ >>= now;
      const std::uint32_t part = std::min(code_ / range_, (1u << now) - 1u);
      code_ -= part * range_;
      value = value << now | part;
      normalise();
    }
    return value;
  }

 private:
  void normalise() {
    while (range_ < (1u << 24)) {
      range_ <<= 8;
      code_ = code_ << 8 | next();
    }
  }
  std::uint32_t next() { return at_ < bytes_.size() ? std::uint32_t(bytes_[at_++]) : 0u; }

  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  std::uint32_t range_ = 0xffffffffu, code_ = 0;
};

// ---- The two sides of a coder, and one that only measures

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

struct Reader {
  RangeDecoder coder;
  bool bit(BitModel& model, bool) { return coder.bit(model); }
  std::uint32_t raw(std::uint32_t, int bits) { return coder.raw(bits); }
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

// ---- Numbers

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

// ---- Bytes of records, lists of positions and the like: small numbers and texts that repeat (byte_coder.cpp)

[[nodiscard]] std::vector<std::byte> encodeBytes(std::span<const std::byte> bytes);

/// Decodes what encodeBytes() made of `count` bytes. Zeros after it are ignored. Damaged bytes are decoded,
/// too, to others.
[[nodiscard]] std::vector<std::byte> decodeBytes(std::span<const std::byte> coded,
                                                 std::uint64_t count);

}  // namespace esvr::codec
