// Plan: integers of every length come back, in as many bytes as 7 bits a byte take. Integers of more
// than 64 bits and truncated ones are refused.

#include "format/bytes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>

namespace esvr::format {
namespace {

TEST(Varint, ComesBackInTheFewestBytes) {
  for (int bits = 0; bits <= 64; ++bits)
    for (const std::uint64_t less : {0u, 1u}) {
      const std::uint64_t value = (bits == 64 ? 0 : std::uint64_t{1} << bits) - less;
      ByteWriter out;
      putVarint(out, value);
      EXPECT_EQ(int(out.size()), std::max((int(std::bit_width(value)) + 6) / 7, 1)) << value;
      ByteReader in(out.bytes(), "test");
      EXPECT_EQ(getVarint(in), value);
      EXPECT_EQ(in.left(), 0u);
    }
}

TEST(Varint, RefusesTooManyBitsAndTruncation) {
  const auto read = [](std::span<const std::uint8_t> bytes) {
    ByteReader in(std::as_bytes(bytes), "test");
    return getVarint(in);
  };
  std::array<std::uint8_t, 10> bytes;
  bytes.fill(0xff);
  bytes.back() = 1;
  EXPECT_EQ(read(bytes), ~std::uint64_t{0});
  bytes.back() = 2;
  EXPECT_THROW((void)read(bytes), BadInput);
  bytes.back() = 0x81;
  EXPECT_THROW((void)read(bytes), BadInput);
  EXPECT_THROW((void)read(std::span(bytes).first(3)), BadInput);
}

}  // namespace
}  // namespace esvr::format
