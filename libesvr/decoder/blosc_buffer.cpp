#include "decoder/blosc_buffer.h"

#include <algorithm>
#include <cstdint>
#include <vector>

#include "decoder/zstd.h"
#include "esvr/error.h"

namespace esvr::decoder {
namespace {

constexpr std::size_t kHeaderBytes = 16, kNumberBytes = 4;
constexpr std::uint8_t kFormat = 2;  ///< version of C-Blosc 1's buffers

std::uint32_t numberAt(std::span<const std::byte> bytes, std::size_t place) {
  std::uint32_t value = 0;
  for (std::size_t b = 0; b < kNumberBytes; ++b)
    value |= std::to_integer<std::uint32_t>(bytes[place + b]) << (8 * b);
  return value;
}

/// The header of a buffer.
struct Header {
  enum Flag : std::uint8_t { kShuffled = 1, kStored = 2, kBitsShuffled = 4, kWhole = 16 };
  static constexpr std::uint8_t kZstd = 4;  ///< the compressor, in the three highest bits

  std::uint8_t format, flags, typeSize;
  std::size_t content, block, bytes;

  explicit Header(std::span<const std::byte> h)
      : format(std::to_integer<std::uint8_t>(h[0])),
        flags(std::to_integer<std::uint8_t>(h[2])),
        typeSize(std::to_integer<std::uint8_t>(h[3])),
        content(numberAt(h, 4)),
        block(numberAt(h, 8)),
        bytes(numberAt(h, 12)) {}

  [[nodiscard]] bool has(Flag flag) const { return (flags & flag) != 0; }
  [[nodiscard]] std::size_t blocks() const { return (content + block - 1) / block; }
};

/// Decompresses one buffer.
class Buffer {
 public:
  Buffer(std::span<const std::byte> bytes, const std::string& where)
      : bytes_(bytes), where_(where), header_(bytes) {}

  std::size_t decompress(std::span<std::byte> to) {
    check(to.size());
    if (header_.has(Header::kStored)) return copyStored(to);
    require(kHeaderBytes + header_.blocks() * kNumberBytes <= bytes_.size());
    for (std::size_t b = 0; b < header_.blocks(); ++b)
      decompressBlock(b, to.subspan(b * header_.block,
                                    std::min(header_.block, header_.content - b * header_.block)));
    return header_.content;
  }

 private:
  void require(bool good) const {
    if (!good) throw BadInput(where_ + ": damaged Blosc buffer");
  }

  void check(std::size_t room) const {
    require(header_.format == kFormat && header_.bytes == bytes_.size() && header_.content > 0 &&
            header_.content <= room && header_.block > 0 && header_.block <= header_.content &&
            header_.typeSize > 0);
    if (!header_.has(Header::kStored) && header_.flags >> 5 != Header::kZstd)
      throw BadInput(where_ +
                     ": compressed by another compressor of Blosc than Zstandard, which "
                     "this decoder does not read");
  }

  std::size_t copyStored(std::span<std::byte> to) const {
    require(bytes_.size() == kHeaderBytes + header_.content);
    std::copy(bytes_.begin() + kHeaderBytes, bytes_.end(), to.begin());
    return header_.content;
  }

  /// A block consists of streams, one for each byte of a number or one for all.
  void decompressBlock(std::size_t b, std::span<std::byte> to) {
    std::size_t at = numberAt(bytes_, kHeaderBytes + b * kNumberBytes);
    const bool last = to.size() < header_.block;
    const std::size_t streams = header_.has(Header::kWhole) || last ? 1 : header_.typeSize;
    require(to.size() % streams == 0);
    shuffled_.resize(to.size());
    for (std::size_t s = 0; s < streams; ++s) {
      require(at <= bytes_.size() && bytes_.size() - at >= kNumberBytes);
      const std::size_t size = numberAt(bytes_, at);
      at += kNumberBytes;
      require(size <= bytes_.size() - at);
      const std::size_t share = to.size() / streams;
      decompressStream(bytes_.subspan(at, size), std::span(shuffled_).subspan(s * share, share));
      at += size;
    }
    unshuffle(to);
  }

  void decompressStream(std::span<const std::byte> stream, std::span<std::byte> to) const {
    if (stream.size() == to.size())
      std::ranges::copy(stream, to.begin());
    else
      decompressZstd(stream, to, where_);
  }

  void unshuffle(std::span<std::byte> to) const {
    const std::size_t numbers = to.size() / header_.typeSize;
    if (header_.has(Header::kShuffled) && header_.typeSize > 1)
      unshuffleBytes(to, numbers);
    else if (header_.has(Header::kBitsShuffled) && numbers > 0 && numbers % 8 == 0)
      unshuffleBits(to, numbers);
    else
      std::ranges::copy(shuffled_, to.begin());
  }
  /// The first bytes of all numbers come first, and so on.
  void unshuffleBytes(std::span<std::byte> to, std::size_t numbers) const {
    const std::size_t size = header_.typeSize, whole = numbers * size;
    for (std::size_t i = 0; i < whole; ++i) to[i % numbers * size + i / numbers] = shuffled_[i];
    copyRest(to, whole);
  }
  /// The lowest bits of all numbers come first, and so on.
  void unshuffleBits(std::span<std::byte> to, std::size_t numbers) const {
    const std::size_t size = header_.typeSize, whole = numbers * size, row = numbers / 8;
    std::fill_n(to.begin(), whole, std::byte{});
    for (std::size_t i = 0; i < whole; ++i) {
      const std::size_t bit = i / row, first = i % row * 8;
      for (std::size_t n = 0; n < 8; ++n)
        to[(first + n) * size + bit / 8] |= (shuffled_[i] >> n & std::byte{1}) << (bit % 8);
    }
    copyRest(to, whole);
  }
  /// Bytes behind the last whole number are not shuffled.
  void copyRest(std::span<std::byte> to, std::size_t whole) const {
    std::copy(shuffled_.begin() + std::ptrdiff_t(whole), shuffled_.end(),
              to.begin() + std::ptrdiff_t(whole));
  }

  std::span<const std::byte> bytes_;
  const std::string& where_;
  Header header_;
  std::vector<std::byte> shuffled_;
};

}  // namespace

std::size_t bloscBufferBytes(std::span<const std::byte> header) { return Header(header).bytes; }

std::size_t decompressBlosc(std::span<const std::byte> buffer, std::span<std::byte> to,
                            const std::string& where) {
  if (buffer.size() < kHeaderBytes) throw BadInput(where + ": damaged Blosc buffer");
  return Buffer(buffer, where).decompress(to);
}

}  // namespace esvr::decoder
