// Plan: bytes of all kinds come back, also from a stream without its zeros and with zeros after it. Records, texts
// and lists of positions become as small as measured; noise hardly grows. Anything else is decoded, too, to as many
// bytes as were asked for.

#include "codec/byte_coder.h"

#include <gtest/gtest.h>

#include <random>
#include <string>

namespace esvr::codec {
namespace {

using Bytes = std::vector<std::byte>;

Bytes bytesOf(const std::string& text) {
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

Bytes noise(std::size_t size) {
  std::mt19937 random(7);
  Bytes bytes(size);
  for (std::byte& b : bytes) b = std::byte(random() & 0xffu);
  return bytes;
}

/// Bricks of a spherical shell as lists of x, y and z in four bytes each.
Bytes shell(int radius) {
  std::vector<std::int32_t> lists[3];
  for (int x = -radius; x <= radius; ++x)
    for (int y = -radius; y <= radius; ++y)
      for (int z = -radius; z <= radius; ++z)
        if (const int d = x * x + y * y + z * z - radius * radius; d >= -radius && d < radius)
          lists[0].push_back(x), lists[1].push_back(y), lists[2].push_back(z);
  Bytes bytes;
  for (const auto& list : lists)
    for (const std::byte b : std::as_bytes(std::span(list))) bytes.push_back(b);
  return bytes;
}

std::size_t codedSize(const Bytes& bytes) {
  const Bytes coded = encodeBytes(bytes);
  EXPECT_EQ(decodeBytes(coded, bytes.size()), bytes);
  Bytes longer = coded;
  longer.resize(coded.size() + 9);
  EXPECT_EQ(decodeBytes(longer, bytes.size()), bytes);
  return coded.size();
}

TEST(ByteCoder, BringsBackShortContents) {
  EXPECT_EQ(codedSize({}), 0u);
  for (int value = 0; value < 256; ++value) EXPECT_LE(codedSize({std::byte(value)}), 4u);
  for (std::size_t size = 2; size < 40; ++size) {
    EXPECT_LE(codedSize(noise(size)), size * 4 / 3 + 3);
    EXPECT_LE(codedSize(Bytes(size)), 6u);
  }
}

TEST(ByteCoder, LeavesNoiseAboutAsLargeAsItIs) {
  EXPECT_LT(double(codedSize(noise(100'000))), 1.18 * 100'000);
}

TEST(ByteCoder, FindsWhatRepeats) {
  EXPECT_LT(codedSize(Bytes(1'000'000)), 100u);
  std::string metadata;
  for (int i = 0; i < 8; ++i)
    metadata += "density" + std::to_string(i) + std::string(3, '\0') +
                "UniformScaleMap is_saved_as_half_float bool class string fog volume";
  EXPECT_LT(codedSize(bytesOf(metadata)), 110u) << "of " << metadata.size();
}

TEST(ByteCoder, TakesLessThanFourBitsForABrickOfAShell) {
  const Bytes bricks = shell(20);
  EXPECT_LT(codedSize(bricks) * 8, bricks.size() / 12 * 4) << bricks.size() / 12 << " bricks";
}

TEST(ByteCoder, DecodesAnything) {
  for (const std::size_t size : {0, 1, 7, 1000})
    EXPECT_EQ(decodeBytes(noise(size), 5000).size(), 5000u);
}

}  // namespace
}  // namespace esvr::codec
