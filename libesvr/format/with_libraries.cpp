// What needs libraries that the decoder-only build does not have: checksums by xxHash, and the bytes of carried grids, which
// Blosc compresses.

#include <blosc.h>
#include <xxhash.h>

#include <algorithm>
#include <limits>
#include <span>
#include <stdexcept>
#include <vector>

#include "core/parallel.h"
#include "esvr/error.h"
#include "format/bytes.h"
#include "format/section_table.h"

namespace esvr::format {
namespace {

constexpr XXH64_hash_t kSeed = 0;

}  // namespace

std::uint64_t checksum(std::span<const std::byte> bytes) {
  return XXH64(bytes.data(), bytes.size(), kSeed);
}

RunningChecksum::RunningChecksum() : state_(XXH64_createState()) {
  XXH64_reset(state_.get(), kSeed);
}

void RunningChecksum::add(std::span<const std::byte> piece) {
  XXH64_update(state_.get(), piece.data(), piece.size());
}

std::uint64_t RunningChecksum::value() const { return XXH64_digest(state_.get()); }

void RunningChecksum::Free::operator()(XXH64_state_s* state) const { XXH64_freeState(state); }

// ---- The bytes of carried grids

namespace {

// Zstandard at this level gives the smallest sections among the fast settings.
constexpr const char* kCompressor = BLOSC_ZSTD_COMPNAME;
constexpr int kLevel = 5;
constexpr std::size_t kBlockBytes = 256 * 1024;

/// Bytes of content in one Blosc buffer. A reader needs memory for one buffer at a time.
constexpr std::size_t kBufferBytes = std::size_t{1} << 26;

/// Bytes that compression must save; otherwise the section is stored raw, which needs no Blosc.
constexpr std::uint64_t kMinBloscSaving = 64;

/// Blosc shuffles the bits of eight numbers together and leaves a block of another length
/// unshuffled. Content is therefore padded with zeros to a multiple of eight of the largest
/// numbers.
constexpr std::uint64_t kPadding = 8 * sizeof(double);

constexpr int kThreads = 1;  // more threads would use Blosc's global pool

std::uint64_t paddedForBlosc(std::uint64_t rawBytes) {
  return (rawBytes + kPadding - 1) / kPadding * kPadding;
}

/// The shuffle that is applied to numbers of one size before they are compressed.
struct Filter {
  int shuffle = BLOSC_NOSHUFFLE;
  std::size_t typeSize = 1;
};

// The bytes consist of numbers of a size that is not known: topology, and values of 2, 4 or 8 bytes or
// three of them. The filter that compresses a sample best is taken.
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

/// How much work compression is.
struct Effort {
  int level = kLevel;
  std::size_t blockBytes = kBlockBytes;
};

/// Content up to this size is compressed in one block at Zstandard's highest level, which takes
/// about a second for 1 MB. It saves 4 to 5 % of the bytes of the points and vectors that were tried.
constexpr std::size_t kLargestThorough = std::size_t{1} << 21;
constexpr Effort kThorough{9, kLargestThorough};

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
  for (const Filter& filter : kFilters) {
    std::vector<std::byte> packed;
    compressTo(packed, sample, filter);
    if (packed.size() < fewest) best = filter, fewest = packed.size();
  }
  return best;
}

/// True if the compressed bytes are worth their decoder, and a reader accepts them.
bool pays(std::uint64_t packedBytes, std::uint64_t rawBytes) {
  return packedBytes + kMinBloscSaving <= rawBytes &&
         plausibleSizes(Codec::kBlosc, packedBytes, rawBytes);
}

VoxelArray<std::byte> readRaw(const ByteSource& source, const SectionEntry& entry,
                              const VoxelMemory& memory) {
  VoxelArray<std::byte> content(entry.rawBytes, memory);
  auto to = content.begin();
  forEachPiece(source, entry, [&](auto piece) { to = std::ranges::copy(piece, to).out; });
  return content;
}

/// The bytes of a buffer with this header, which is not checked.
std::uint64_t storedBytesOf(std::span<const std::byte> header) {
  if (header.size() < BLOSC_MIN_HEADER_LENGTH) return header.size();
  std::size_t raw = 0, packed = 0, block = 0;
  blosc_cbuffer_sizes(header.data(), &raw, &packed, &block);
  return packed;
}

/// Bytes of content in the buffer; 0 if it is damaged or has more content than there is room for.
std::size_t contentOf(std::span<const std::byte> buffer, std::size_t room) {
  if (buffer.size() < BLOSC_MIN_HEADER_LENGTH) return 0;
  std::size_t raw = 0, packed = 0, block = 0, validated = 0;
  blosc_cbuffer_sizes(buffer.data(), &raw, &packed, &block);
  const bool fits = packed == buffer.size() && raw <= room && block <= raw;
  return fits && blosc_cbuffer_validate(buffer.data(), packed, &validated) == 0 ? raw : 0;
}

/// Decompresses a buffer to the beginning of `to`. \return the bytes of its content, above 0
std::size_t decompressBuffer(std::span<const std::byte> buffer, std::span<std::byte> to,
                             const std::string& where) {
  const std::size_t raw = contentOf(buffer, to.size());
  if (raw == 0 || blosc_decompress_ctx(buffer.data(), to.data(), raw, kThreads) != int(raw))
    throw BadInput(where + ": damaged Blosc buffer");
  return raw;
}

VoxelArray<std::byte> readBlosc(const ByteSource& source, const SectionEntry& entry,
                                const std::string& where, const VoxelMemory& memory) {
  VoxelArray<std::byte> content(paddedForBlosc(entry.rawBytes), memory);
  const PartSource stored(source, entry.offset, entry.storedBytes, where);
  std::span<std::byte> left(content);
  std::uint64_t at = 0;
  while (at < stored.size() || !left.empty()) {
    throwIfCancelled();
    const auto buffer = stored.read(at, storedBytesOf(stored.read(at, BLOSC_MIN_HEADER_LENGTH)));
    left = left.subspan(decompressBuffer(buffer, left, where));
    at += buffer.size();
  }
  const auto padding = std::span(content).subspan(entry.rawBytes);
  if (!std::ranges::all_of(padding, [](std::byte b) { return b == std::byte{}; }))
    throw BadInput(where + ": content after its end");
  content.resize(entry.rawBytes);
  return content;
}

}  // namespace

PackedCarried packCarried(const VoxelArray<std::byte>& raw) {
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

VoxelArray<std::byte> readCarried(const ByteSource& source, const SectionTable& table,
                                  std::size_t entry, const VoxelMemory& memory) {
  checkStored(source, table, entry);
  const SectionEntry& e = table.entries[entry];
  if (e.codec == Codec::kRaw) return readRaw(source, e, memory);
  return readBlosc(source, e, placeOf(source.name(), table, entry), memory);
}

}  // namespace esvr::format
