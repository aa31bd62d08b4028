// Buffers of Blosc, by its library. The decoder-only build has decoder/codec.cpp in place of this file.

#include <blosc.h>

#include "esvr/error.h"
#include "format/codec.h"

namespace esvr::format {
namespace {

static_assert(kBloscHeaderBytes == BLOSC_MIN_HEADER_LENGTH);
constexpr int kThreads = 1;  // more threads would use Blosc's global pool

/// Bytes of content in the buffer; 0 if it is damaged or has more content than there is room for.
std::size_t contentOf(std::span<const std::byte> buffer, std::size_t room) {
  if (buffer.size() < BLOSC_MIN_HEADER_LENGTH) return 0;
  std::size_t raw = 0, packed = 0, block = 0, validated = 0;
  blosc_cbuffer_sizes(buffer.data(), &raw, &packed, &block);
  const bool fits = packed == buffer.size() && raw <= room && block <= raw;
  return fits && blosc_cbuffer_validate(buffer.data(), packed, &validated) == 0 ? raw : 0;
}

}  // namespace

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

}  // namespace esvr::format
