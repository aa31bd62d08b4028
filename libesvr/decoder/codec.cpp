// Buffers of Blosc without its library (format/codec.h), for the decoder-only build.

#include "format/codec.h"

#include "decoder/blosc_buffer.h"

namespace esvr::format {

std::uint64_t storedBytesOf(std::span<const std::byte> header) {
  return header.size() < kBloscHeaderBytes ? header.size() : decoder::bloscBufferBytes(header);
}

std::size_t decompressBuffer(std::span<const std::byte> buffer, std::span<std::byte> to,
                             const std::string& where) {
  return decoder::decompressBlosc(buffer, to, where);
}

}  // namespace esvr::format
