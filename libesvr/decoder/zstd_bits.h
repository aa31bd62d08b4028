#pragma once
/// The bit streams of Zstandard (RFC 8878, sections 4.1 and 4.2).

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>

namespace esvr::decoder {

/// The frame is damaged. decompressZstd() makes a BadInput of it.
struct BadFrame : std::runtime_error {
  using std::runtime_error::runtime_error;
};

inline void require(bool good, const char* otherwise) {
  if (!good) throw BadFrame(otherwise);
}

/// Reads bytes, and numbers of up to four bytes, lowest byte first.
class Bytes {
 public:
  explicit Bytes(std::span<const std::byte> bytes) : left_(bytes) {}

  [[nodiscard]] std::size_t size() const { return left_.size(); }
  [[nodiscard]] bool empty() const { return left_.empty(); }
  [[nodiscard]] std::span<const std::byte> rest() const { return left_; }

  std::span<const std::byte> take(std::size_t count) {
    require(count <= left_.size(), "it ends too early");
    const auto taken = left_.first(count);
    left_ = left_.subspan(count);
    return taken;
  }
  std::uint64_t number(std::size_t bytes) {
    std::uint64_t value = 0;
    unsigned shift = 0;
    for (const std::byte b : take(bytes)) value |= std::uint64_t(b) << shift, shift += 8;
    return value;
  }
  std::uint32_t byte() { return std::uint32_t(number(1)); }

 private:
  std::span<const std::byte> left_;
};

/// Reads up to 32 bits from a place of a byte stream, lowest bit first. Bits outside are 0.
inline std::uint32_t bitsAt(std::span<const std::byte> bytes, std::ptrdiff_t place, int count) {
  std::uint64_t value = 0;
  const std::ptrdiff_t first = place >> 3;
  for (std::ptrdiff_t b = 0; b < 5; ++b)
    if (first + b >= 0 && first + b < std::ptrdiff_t(bytes.size()))
      value |= std::uint64_t(bytes[std::size_t(first + b)]) << (8 * b);
  return std::uint32_t(value >> (place & 7) & ((std::uint64_t{1} << count) - 1));
}

/// A stream that is read from its first bit on: the description of a table.
class ForwardBits {
 public:
  explicit ForwardBits(std::span<const std::byte> bytes) : bytes_(bytes) {}
  std::uint32_t read(int count) {
    const std::uint32_t bits = bitsAt(bytes_, place_, count);
    place_ += count;
    return bits;
  }
  void back(int count) { place_ -= count; }
  /// The bytes that have been read, wholly or in part.
  [[nodiscard]] std::size_t bytesRead() const { return std::size_t(place_ + 7) / 8; }

 private:
  std::span<const std::byte> bytes_;
  std::ptrdiff_t place_ = 0;
};

/// A stream that is read from its last bit on. The highest bit that is set in its last byte marks
/// its end. Bits before the first one are 0.
class BackwardBits {
 public:
  explicit BackwardBits(std::span<const std::byte> bytes) : bytes_(bytes) {
    require(!bytes.empty() && bytes.back() != std::byte{}, "a stream has no end");
    place_ = std::ptrdiff_t(bytes.size() - 1) * 8 +
             std::bit_width(std::uint32_t(std::to_integer<std::uint8_t>(bytes.back()))) - 1;
  }
  std::uint32_t read(int count) {
    place_ -= count;
    return bitsAt(bytes_, place_, count);
  }
  /// Number of bits that are left; negative if more were read than there are.
  [[nodiscard]] std::ptrdiff_t left() const { return place_; }

 private:
  std::span<const std::byte> bytes_;
  std::ptrdiff_t place_ = 0;
};

}  // namespace esvr::decoder
