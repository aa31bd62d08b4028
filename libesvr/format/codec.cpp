#include "format/codec.h"

#include <blosc.h>

#include <algorithm>
#include <stdexcept>

#include "esvr/error.h"

namespace esvr::format {
namespace {

// Zstandard at this level gives the smallest sections among the fast settings.
constexpr const char* kCompressor = BLOSC_ZSTD_COMPNAME;
constexpr int kLevel = 5;
constexpr std::size_t kBlockBytes = 256 * 1024;

/// Blosc shuffles the bits of eight numbers together and leaves a block of another length
/// unshuffled. Content is therefore padded with zeros to a multiple of eight of the largest
/// numbers.
constexpr std::uint64_t kPadding = 8 * sizeof(double);

/// Bytes of content in one Blosc buffer; Blosc's own limit is 2^31.
constexpr std::size_t kBufferBytes = std::size_t{1} << 30;

/// Limit on the ratio of content to stored bytes. The writer stays below it, so a reader can refuse
/// higher ratios. Zeros in blocks of this size reach half of it.
constexpr std::uint64_t kMaxBloscRatio = 16384;

/// Bytes that compression must save; otherwise the section is stored raw, which needs no decoder.
constexpr std::uint64_t kMinSaving = 64;

constexpr int kThreads = 1;  // more threads would use Blosc's global pool

/// The shuffle that is applied to numbers of one size before they are compressed.
struct Filter {
  int shuffle = BLOSC_NOSHUFFLE;
  std::size_t typeSize = 1;
};

std::uint64_t padded(std::uint64_t bytes) { return (bytes + kPadding - 1) / kPadding * kPadding; }

void appendBuffer(std::vector<std::byte>& all, std::span<const std::byte> raw, Filter filter) {
  std::vector<std::byte> packed(raw.size() + BLOSC_MAX_OVERHEAD);
  const int n =
      blosc_compress_ctx(kLevel, filter.shuffle, filter.typeSize, raw.size(), raw.data(),
                         packed.data(), packed.size(), kCompressor, kBlockBytes, kThreads);
  if (n <= 0) throw std::logic_error("Blosc failed to compress a buffer");
  all.insert(all.end(), packed.begin(), packed.begin() + n);
}

std::vector<std::byte> compress(std::span<const std::byte> raw, Filter filter) {
  std::vector<std::byte> all;
  while (!raw.empty()) {
    const auto piece = raw.first(std::min(raw.size(), kBufferBytes));
    appendBuffer(all, piece, filter);
    raw = raw.subspan(piece.size());
  }
  return all;
}

/// Shuffles bytes and shuffles bits, and returns the smaller result. Which one it is differs
/// between streams.
std::vector<std::byte> compressSmallest(std::vector<std::byte> raw, std::size_t typeSize) {
  raw.resize(padded(raw.size()));
  if (typeSize == 1) return compress(raw, {});
  auto bytesShuffled = compress(raw, {BLOSC_SHUFFLE, typeSize});
  auto bitsShuffled = compress(raw, {BLOSC_BITSHUFFLE, typeSize});
  return bitsShuffled.size() < bytesShuffled.size() ? bitsShuffled : bytesShuffled;
}

struct BufferSizes {
  std::size_t raw = 0, stored = 0;
};

/// Sizes of the first buffer in `stored`; zeros if they are impossible.
BufferSizes frontBuffer(std::span<const std::byte> stored, std::size_t rawLeft) {
  if (stored.size() < BLOSC_MIN_HEADER_LENGTH) return {};
  std::size_t raw = 0, packed = 0, block = 0, validated = 0;
  blosc_cbuffer_sizes(stored.data(), &raw, &packed, &block);
  const bool fits = packed <= stored.size() && raw <= rawLeft && block <= raw;
  if (!fits || blosc_cbuffer_validate(stored.data(), packed, &validated) != 0) return {};
  return {raw, packed};
}

std::vector<std::byte> decompress(std::span<const std::byte> stored, std::uint64_t rawBytes,
                                  const std::string& where) {
  std::vector<std::byte> raw(padded(rawBytes));
  std::span<std::byte> left(raw);
  while (!left.empty() || !stored.empty()) {
    const BufferSizes sizes = frontBuffer(stored, left.size());
    if (sizes.raw == 0 ||
        blosc_decompress_ctx(stored.data(), left.data(), sizes.raw, kThreads) != int(sizes.raw))
      throw BadInput(where + ": damaged Blosc buffer");
    left = left.subspan(sizes.raw);
    stored = stored.subspan(sizes.stored);
  }
  const auto isZero = [](std::byte b) { return b == std::byte{}; };
  if (!std::all_of(raw.begin() + std::ptrdiff_t(rawBytes), raw.end(), isZero))
    throw BadInput(where + ": content after its end");
  raw.resize(rawBytes);
  return raw;
}

}  // namespace

Packed pack(std::vector<std::byte> raw, std::size_t typeSize) {
  const std::uint64_t rawBytes = raw.size();
  auto packed = compressSmallest(raw, typeSize);
  const bool pays = packed.size() + kMinSaving <= rawBytes;
  if (pays && plausibleSizes(Codec::kBlosc, packed.size(), rawBytes))
    return {Codec::kBlosc, std::move(packed), rawBytes};
  return {Codec::kRaw, std::move(raw), rawBytes};
}

bool plausibleSizes(Codec codec, std::uint64_t storedBytes, std::uint64_t rawBytes) {
  if (codec == Codec::kRaw) return storedBytes == rawBytes;
  return rawBytes / kMaxBloscRatio <= storedBytes;
}

std::vector<std::byte> unpack(Codec codec, std::vector<std::byte> stored, std::uint64_t rawBytes,
                              const std::string& where) {
  return codec == Codec::kRaw ? std::move(stored) : decompress(stored, rawBytes, where);
}

}  // namespace esvr::format
