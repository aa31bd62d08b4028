// Plan: integers of every length and content of every codec come back, in as many bytes as they should
// take. Sizes and codecs that cannot be are refused before memory is allocated.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <random>

#include "esvr/error.h"
#include "format/bytes.h"
#include "format/section_table.h"
#include "support/messages.h"

namespace esvr::format {
namespace {

// Bytes.

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

// The table.

using Bytes = std::vector<std::byte>;

Bytes floats(std::size_t count) {
  std::mt19937 random(3);
  std::vector<float> values(count);
  for (float& value : values) value = 0.5f + 2.0f * float(random()) / 4294967296.0f;
  const auto bytes = std::as_bytes(std::span(values));
  return {bytes.begin(), bytes.end()};
}

Bytes contentOf(const Packed& packed) {
  EXPECT_TRUE(plausibleSizes(packed.codec, packed.bytes.size(), packed.rawBytes));
  return unpack(packed.codec, packed.bytes, packed.rawBytes, "x");
}

TEST(Codec, BringsContentBack) {
  for (const Bytes& content : {Bytes{}, Bytes(1), Bytes(3'000'000), floats(1), floats(500)}) {
    EXPECT_EQ(contentOf(pack(content)), content);
    if (content.size() % 4 == 0) {
      EXPECT_EQ(contentOf(packFloats(content)), content);
    }
  }
}

TEST(Codec, StoresRawWhereCompressionSavesNothing) {
  EXPECT_EQ(pack(Bytes(8)).codec, Codec::kRaw);
  EXPECT_EQ(pack(Bytes(80)).codec, Codec::kBytes);
  EXPECT_EQ(packFloats(floats(4)).codec, Codec::kRaw);
}

TEST(Codec, StoresTheLowBytesOfFloatsAsTheyAre) {
  const Bytes content = floats(1000);
  const Packed packed = packFloats(content);
  EXPECT_EQ(packed.codec, Codec::kFloats);
  EXPECT_LT(packed.bytes.size(), 3200u);
  EXPECT_EQ(Bytes(packed.bytes.begin() + 3, packed.bytes.begin() + 6),
            Bytes(content.begin() + 4, content.begin() + 7));
  EXPECT_LT(packed.bytes.size(), pack(content).bytes.size());
}

TEST(Codec, StoresFloatsOfFewDigitsAsBytes) {
  std::vector<float> values;
  for (int i = 0; i < 500; ++i) values.push_back(float(i % 37) * 0.25f);
  const auto bytes = std::as_bytes(std::span(values));
  const Packed packed = packFloats({bytes.begin(), bytes.end()});
  EXPECT_EQ(packed.codec, Codec::kBytes);
  EXPECT_LT(packed.bytes.size(), 400u);
}

TEST(Codec, KnowsSizesThatCannotBe) {
  EXPECT_FALSE(plausibleSizes(Codec::kRaw, 7, 8));
  EXPECT_TRUE(plausibleSizes(Codec::kBytes, 0, 1023));
  EXPECT_FALSE(plausibleSizes(Codec::kBytes, 0, 1024));
  EXPECT_TRUE(plausibleSizes(Codec::kFloats, 6, 8));
  EXPECT_FALSE(plausibleSizes(Codec::kFloats, 5, 8));
  EXPECT_FALSE(plausibleSizes(Codec::kFloats, 8, 7));
  EXPECT_FALSE(plausibleSizes(Codec::kBlosc, 0, 16384));
}

TEST(Codec, LeavesBloscToCarriedGrids) {
  EXPECT_THAT([] { (void)unpack(Codec::kBlosc, Bytes(100), 100, "place"); },
              test::ThrowsSaying<BadInput>("place: Blosc"));
}

}  // namespace
}  // namespace esvr::format
