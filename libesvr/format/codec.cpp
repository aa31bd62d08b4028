#include "format/codec.h"

#include <algorithm>
#include <span>
#include <utility>

#include "codec/byte_coder.h"
#include "esvr/error.h"

namespace esvr::format {
namespace {

/// Bytes that compression must save. Sections lie at multiples of it, so that less saves nothing.
constexpr std::uint64_t kMinSaving = kAlignment;

/// Limits on the ratio of content to stored bytes, so that a small file cannot ask a reader for much memory
/// or time. Lists of positions reach 50; the writer adds zeros where content is compressed further. Zeros in
/// Blosc's blocks reach half of its limit, and the writer stores raw what is above.
constexpr std::uint64_t kMaxRatio = 1024, kMaxBloscRatio = 16384;

/// Bytes of an f32 that are stored as they are. Those of a fit are noise, and only the highest byte, which
/// has the sign and most of the exponent, can be compressed.
constexpr std::size_t kLowBytes = sizeof(float) - 1;

/// Bytes on which the codec of floats is compared with that of bytes. The latter is better for numbers of
/// few digits, which no fit makes.
constexpr std::size_t kSample = std::size_t{1} << 16;

std::vector<std::byte> codedFloats(std::span<const std::byte> raw) {
  std::vector<std::byte> stored, high;
  for (std::size_t i = 0; i < raw.size(); ++i)
    (i % sizeof(float) == kLowBytes ? high : stored).push_back(raw[i]);
  const auto coded = codec::encodeBytes(high);
  stored.insert(stored.end(), coded.begin(), coded.end());
  return stored;
}

Packed chosen(Codec codec, std::vector<std::byte> packed, std::vector<std::byte> raw) {
  const std::uint64_t rawBytes = raw.size();
  if (packed.size() + kMinSaving > rawBytes) return {Codec::kRaw, std::move(raw), rawBytes};
  return {codec, std::move(packed), rawBytes};
}

std::vector<std::byte> unpackFloats(std::span<const std::byte> stored, std::uint64_t rawBytes) {
  const std::uint64_t count = rawBytes / sizeof(float);
  const auto high = codec::decodeBytes(stored.subspan(count * kLowBytes), count);
  std::vector<std::byte> raw(rawBytes);
  for (std::uint64_t i = 0; i < count; ++i) {
    std::ranges::copy(stored.subspan(i * kLowBytes, kLowBytes),
                      raw.begin() + std::ptrdiff_t(i * sizeof(float)));
    raw[i * sizeof(float) + kLowBytes] = high[i];
  }
  return raw;
}

}  // namespace

Packed pack(std::vector<std::byte> raw) {
  auto packed = codec::encodeBytes(raw);
  packed.resize(std::max<std::uint64_t>(packed.size(), raw.size() / kMaxRatio));
  return chosen(Codec::kBytes, std::move(packed), std::move(raw));
}

Packed packFloats(std::vector<std::byte> raw) {
  const auto start = std::span(raw).first(std::min(raw.size(), kSample));
  if (codec::encodeBytes(start).size() < codedFloats(start).size()) return pack(std::move(raw));
  auto packed = codedFloats(raw);
  return chosen(Codec::kFloats, std::move(packed), std::move(raw));
}

bool plausibleSizes(Codec codec, std::uint64_t storedBytes, std::uint64_t rawBytes) {
  if (codec == Codec::kRaw) return storedBytes == rawBytes;
  if (codec == Codec::kFloats)
    return rawBytes % sizeof(float) == 0 && rawBytes / sizeof(float) * kLowBytes <= storedBytes;
  return rawBytes / (codec == Codec::kBlosc ? kMaxBloscRatio : kMaxRatio) <= storedBytes;
}

std::vector<std::byte> unpack(Codec codec, std::vector<std::byte> stored, std::uint64_t rawBytes,
                              const std::string& where) {
  switch (codec) {
    case Codec::kRaw:
      return stored;
    case Codec::kBytes:
      return codec::decodeBytes(stored, rawBytes);
    case Codec::kFloats:
      return unpackFloats(stored, rawBytes);
    case Codec::kBlosc:
      break;
  }
  throw BadInput(where + ": Blosc compresses the bytes of carried grids only");
}

}  // namespace esvr::format
