#include "format/codec.h"

#include <blosc.h>

#include <algorithm>
#include <limits>
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

/// How much work compression is.
struct Effort {
  int level = kLevel;
  std::size_t blockBytes = kBlockBytes;
};

std::vector<std::byte> compressed(std::span<const std::byte> raw, Filter filter, Effort effort) {
  std::vector<std::byte> packed(raw.size() + BLOSC_MAX_OVERHEAD);
  const int n =
      blosc_compress_ctx(effort.level, filter.shuffle, filter.typeSize, raw.size(), raw.data(),
                         packed.data(), packed.size(), kCompressor, effort.blockBytes, kThreads);
  if (n <= 0) throw std::logic_error("Blosc failed to compress a buffer");
  packed.resize(std::size_t(n));
  return packed;
}

/// Appends buffers of the content, of which the last one is padded.
template <class Bytes>
void compressTo(Bytes& all, std::span<const std::byte> raw, Filter filter, Effort effort = {}) {
  while (!raw.empty()) {
    const auto piece = raw.first(std::min(raw.size(), kBufferBytes));
    std::vector<std::byte> content(piece.begin(), piece.end());
    content.resize(paddedForBlosc(content.size()));
    const auto buffer = compressed(content, filter, effort);
    all.insert(all.end(), buffer.begin(), buffer.end());
    raw = raw.subspan(piece.size());
  }
}

std::vector<std::byte> compress(std::span<const std::byte> raw, Filter filter, Effort effort = {}) {
  std::vector<std::byte> all;
  compressTo(all, raw, filter, effort);
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

// The bytes of a carried grid consist of numbers of a size that is not known: topology, and values of
// 2, 4 or 8 bytes or three of them. The filter that compresses a sample best is taken.
constexpr Filter kFilters[] = {
    {},
    {BLOSC_SHUFFLE, 2},
    {BLOSC_SHUFFLE, 4},
    {BLOSC_SHUFFLE, 8},
    {BLOSC_SHUFFLE, 12},
    {BLOSC_BITSHUFFLE, 2},
    {BLOSC_BITSHUFFLE, 4},
};
constexpr std::size_t kSampleBytes = std::size_t{1} << 20;
constexpr std::size_t kSamplePieces = 4;

/// Content up to this size is compressed in one block at Zstandard's highest level, which takes
/// about a second for 1 MB. It saves 4 to 5 % of the bytes of the points and vectors that were tried.
constexpr std::size_t kLargestThorough = std::size_t{1} << 21;
constexpr Effort kThorough{9, kLargestThorough};

/// Content that represents all of it: all, or pieces at equal distances.
std::vector<std::byte> sampleOf(std::span<const std::byte> raw) {
  if (raw.size() <= kSampleBytes) return {raw.begin(), raw.end()};
  constexpr std::size_t kPiece = kSampleBytes / kSamplePieces;
  std::vector<std::byte> sample;
  for (std::size_t p = 0; p < kSamplePieces; ++p) {
    const auto piece = raw.subspan((raw.size() - kPiece) / (kSamplePieces - 1) * p, kPiece);
    sample.insert(sample.end(), piece.begin(), piece.end());
  }
  return sample;
}

Filter bestFilter(std::span<const std::byte> raw) {
  const auto sample = sampleOf(raw);
  Filter best;
  std::size_t fewest = std::numeric_limits<std::size_t>::max();
  for (const Filter& filter : kFilters)
    if (const std::size_t bytes = compress(sample, filter).size(); bytes < fewest)
      best = filter, fewest = bytes;
  return best;
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
  const Filter filter = bestFilter(raw);
  VoxelArray<std::byte> packed(raw.get_allocator());
  if (raw.size() <= kLargestThorough) {
    compressTo(packed, raw, filter, kThorough);
    if (pays(packed.size(), raw.size())) return {Codec::kBlosc, std::move(packed)};
    packed.clear();  // a large block of zeros exceeds the ratio that a reader accepts
  }
  compressTo(packed, raw, filter);
  if (pays(packed.size(), raw.size())) return {Codec::kBlosc, std::move(packed)};
  return {Codec::kRaw, raw};
}

}  // namespace esvr::format
