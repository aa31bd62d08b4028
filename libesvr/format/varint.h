#pragma once
/// Unsigned integers in as few bytes as they need: 7 bits a byte, the lowest first. The highest bit
/// of a byte says that another one follows.

#include <cstdint>

#include "format/byte_reader.h"
#include "format/byte_writer.h"

namespace esvr::format {

inline void putVarint(ByteWriter& out, std::uint64_t value) {
  constexpr std::uint64_t kMore = 0x80;
  for (; value >= kMore; value >>= 7) out.put(std::uint8_t((value & (kMore - 1)) | kMore));
  out.put(std::uint8_t(value));
}

/// \throws BadInput  the integer has more than 64 bits
[[nodiscard]] inline std::uint64_t getVarint(ByteReader& in) {
  std::uint64_t value = 0;
  for (int shift = 0;; shift += 7) {
    const std::uint64_t bits = in.get<std::uint8_t>();
    if (shift > 63 || (shift == 63 && bits > 1)) in.fail("an integer has more than 64 bits");
    value |= (bits & 0x7f) << shift;
    if ((bits & 0x80) == 0) return value;
  }
}

}  // namespace esvr::format
