#include "format/codec.h"

#include <blosc.h>

#include <algorithm>
#include <stdexcept>

namespace esvr::format {
namespace {

// Zstandard at this level gives the smallest sections among the fast settings.
constexpr const char* kCompressor = BLOSC_ZSTD_COMPNAME;
constexpr int kLevel = 5;
constexpr std::size_t kBlockBytes = 256 * 1024;

/// Bytes of content in one Blosc buffer. A reader needs memory for one buffer at a time.
constexpr std::size_t kBufferBytes = std::size_t{1} << 26;

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

}  // namespace esvr::format
