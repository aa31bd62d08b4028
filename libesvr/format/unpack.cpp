#include <algorithm>

#include "esvr/error.h"
#include "format/codec.h"

namespace esvr::format {
namespace {

/// Blosc shuffles the bits of eight numbers together and leaves a block of another length
/// unshuffled. Content is therefore padded with zeros to a multiple of eight of the largest
/// numbers.
constexpr std::uint64_t kPadding = 8 * sizeof(double);

/// Limit on the ratio of content to stored bytes. The writer stays below it, so a reader can refuse
/// higher ratios. Zeros in blocks of this size reach half of it.
constexpr std::uint64_t kMaxBloscRatio = 16384;

std::vector<std::byte> decompress(std::span<const std::byte> stored, std::uint64_t rawBytes,
                                  const std::string& where) {
  std::vector<std::byte> raw(paddedForBlosc(rawBytes));
  std::span<std::byte> left(raw);
  while (!left.empty() || !stored.empty()) {
    const auto buffer = stored.first(std::min<std::uint64_t>(stored.size(), storedBytesOf(stored)));
    left = left.subspan(decompressBuffer(buffer, left, where));
    stored = stored.subspan(buffer.size());
  }
  refuseContentAfter(rawBytes, raw, where);
  raw.resize(rawBytes);
  return raw;
}

}  // namespace

std::uint64_t paddedForBlosc(std::uint64_t rawBytes) {
  return (rawBytes + kPadding - 1) / kPadding * kPadding;
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
