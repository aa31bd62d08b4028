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

/// Bytes of content in one Blosc buffer. A reader needs memory for one buffer at a time.
constexpr std::size_t kBufferBytes = std::size_t{1} << 26;
static_assert(kBufferBytes % kPadding == 0);
static_assert(kBloscHeaderBytes == BLOSC_MIN_HEADER_LENGTH);

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

std::vector<std::byte> compressed(std::span<const std::byte> raw, Filter filter) {
  std::vector<std::byte> packed(raw.size() + BLOSC_MAX_OVERHEAD);
  const int n =
      blosc_compress_ctx(kLevel, filter.shuffle, filter.typeSize, raw.size(), raw.data(),
                         packed.data(), packed.size(), kCompressor, kBlockBytes, kThreads);
  if (n <= 0) throw std::logic_error("Blosc failed to compress a buffer");
  packed.resize(std::size_t(n));
  return packed;
}

/// Appends buffers of the content, of which the last one is padded.
template <class Bytes>
void compressTo(Bytes& all, std::span<const std::byte> raw, Filter filter) {
  while (!raw.empty()) {
    const auto piece = raw.first(std::min(raw.size(), kBufferBytes));
    std::vector<std::byte> content(piece.begin(), piece.end());
    content.resize(paddedForBlosc(content.size()));
    const auto buffer = compressed(content, filter);
    all.insert(all.end(), buffer.begin(), buffer.end());
    raw = raw.subspan(piece.size());
  }
}

std::vector<std::byte> compress(std::span<const std::byte> raw, Filter filter) {
  std::vector<std::byte> all;
  compressTo(all, raw, filter);
  return all;
}

/// Shuffles bytes and shuffles bits, and returns the smaller result. Which one it is differs
/// between streams.
std::vector<std::byte> compressSmallest(std::span<const std::byte> raw, std::size_t typeSize) {
  if (typeSize == 1) return compress(raw, {});
  auto bytesShuffled = compress(raw, {BLOSC_SHUFFLE, typeSize});
  auto bitsShuffled = compress(raw, {BLOSC_BITSHUFFLE, typeSize});
  return bitsShuffled.size() < bytesShuffled.size() ? bitsShuffled : bytesShuffled;
}

/// Bytes of content in the buffer; 0 if it is damaged or has more content than there is room for.
std::size_t contentOf(std::span<const std::byte> buffer, std::size_t room) {
  if (buffer.size() < BLOSC_MIN_HEADER_LENGTH) return 0;
  std::size_t raw = 0, packed = 0, block = 0, validated = 0;
  blosc_cbuffer_sizes(buffer.data(), &raw, &packed, &block);
  const bool fits = packed == buffer.size() && raw <= room && block <= raw;
  return fits && blosc_cbuffer_validate(buffer.data(), packed, &validated) == 0 ? raw : 0;
}

std::vector<std::byte> decompress(std::span<const std::byte> stored, std::uint64_t rawBytes,
                                  const std::string& where) {
  std::vector<std::byte> raw(paddedForBlosc(rawBytes));
  std::span<std::byte> left(raw);
  while (!left.empty() || !stored.empty()) {
    const auto buffer = stored.first(std::min(stored.size(), storedBytesOf(stored)));
    left = left.subspan(decompressBuffer(buffer, left, where));
    stored = stored.subspan(buffer.size());
  }
  refuseContentAfter(rawBytes, raw, where);
  raw.resize(rawBytes);
  return raw;
}

/// True if the compressed bytes are worth their decoder.
bool pays(std::uint64_t packedBytes, std::uint64_t rawBytes) {
  return packedBytes + kMinSaving <= rawBytes &&
         plausibleSizes(Codec::kBlosc, packedBytes, rawBytes);
}

}  // namespace

Packed pack(std::vector<std::byte> raw, std::size_t typeSize) {
  const std::uint64_t rawBytes = raw.size();
  auto packed = compressSmallest(raw, typeSize);
  if (pays(packed.size(), rawBytes)) return {Codec::kBlosc, std::move(packed), rawBytes};
  return {Codec::kRaw, std::move(raw), rawBytes};
}

PackedLarge packLarge(const VoxelArray<std::byte>& raw) {
  VoxelArray<std::byte> packed(raw.get_allocator());
  compressTo(packed, raw, {});
  if (pays(packed.size(), raw.size())) return {Codec::kBlosc, std::move(packed)};
  return {Codec::kRaw, raw};
}

std::uint64_t paddedForBlosc(std::uint64_t rawBytes) {
  return (rawBytes + kPadding - 1) / kPadding * kPadding;
}

std::uint64_t storedBytesOf(std::span<const std::byte> header) {
  if (header.size() < kBloscHeaderBytes) return header.size();
  std::size_t raw = 0, packed = 0, block = 0;
  blosc_cbuffer_sizes(header.data(), &raw, &packed, &block);
  return packed;
}

std::size_t decompressBuffer(std::span<const std::byte> buffer, std::span<std::byte> to,
                             const std::string& where) {
  const std::size_t raw = contentOf(buffer, to.size());
  if (raw == 0 || blosc_decompress_ctx(buffer.data(), to.data(), raw, kThreads) != int(raw))
    throw BadInput(where + ": damaged Blosc buffer");
  return raw;
}

void refuseContentAfter(std::uint64_t rawBytes, std::span<const std::byte> content,
                        const std::string& where) {
  const auto isZero = [](std::byte b) { return b == std::byte{}; };
  if (!std::ranges::all_of(content.subspan(rawBytes), isZero))
    throw BadInput(where + ": content after its end");
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
