// Plan: what Blosc compresses with Zstandard comes back bit for bit, whatever the content, the size of
// numbers, the shuffle, the level and the size of blocks. Damage is refused and never reads or writes
// outside its memory (the sanitizers see that). Other compressors are refused by name.

#include "decoder/blosc_buffer.h"

#include <blosc.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

#include "esvr/error.h"

namespace esvr::decoder {
namespace {

using Bytes = std::vector<std::byte>;

struct Setting {
  int level = 5, shuffle = BLOSC_NOSHUFFLE;
  std::size_t typeSize = 1, block = 0;
  const char* compressor = BLOSC_ZSTD_COMPNAME;
};

Bytes compressed(const Bytes& raw, const Setting& s) {
  Bytes packed(raw.size() + BLOSC_MAX_OVERHEAD);
  const int n = blosc_compress_ctx(s.level, s.shuffle, s.typeSize, raw.size(), raw.data(),
                                   packed.data(), packed.size(), s.compressor, s.block, 1);
  packed.resize(std::size_t(n));
  return packed;
}

Bytes decompressed(const Bytes& packed, std::size_t size) {
  Bytes raw(size);
  EXPECT_EQ(decompressBlosc(packed, raw, "x"), size);
  return raw;
}

/// Bytes whose literals, matches and tables differ much between the kinds.
Bytes content(int kind, std::size_t size, std::mt19937& random) {
  constexpr const char* kText = "the quick brown fox jumps over ";
  Bytes bytes(size);
  for (std::size_t i = 0; i < size; ++i) {
    const auto any = [&](unsigned below) { return unsigned(random() % below); };
    const unsigned values[] = {any(256),
                               any(4),
                               unsigned(i / 7),
                               any(50) == 0 ? any(256) : 0,
                               i > 100 && any(10) > 0 ? unsigned(bytes[i - 100 + any(3)]) : any(20),
                               unsigned(kText[i % 31]) + (any(90) == 0 ? 1 : 0)};
    bytes[i] = std::byte(values[kind]);
  }
  return bytes;
}
constexpr int kKinds = 6;

class BloscBuffer : public testing::TestWithParam<int> {};

TEST_P(BloscBuffer, ComesBackBitForBit) {
  std::mt19937 random{unsigned(GetParam())};
  for (const std::size_t typeSize : {1u, 2u, 3u, 4u, 8u, 12u})
    for (const int shuffle : {BLOSC_NOSHUFFLE, BLOSC_SHUFFLE, BLOSC_BITSHUFFLE})
      for (const int level : {1, 5, 9})
        for (const std::size_t block : {std::size_t{0}, std::size_t{256} * 1024}) {
          const Bytes raw = content(GetParam(), 1 + random() % 20000, random);
          const Bytes packed = compressed(raw, {level, shuffle, typeSize, block});
          ASSERT_EQ(bloscBufferBytes(packed), packed.size());
          ASSERT_EQ(decompressed(packed, raw.size()), raw) << typeSize << ' ' << shuffle;
        }
}

TEST_P(BloscBuffer, MayHaveSeveralBlocks) {
  std::mt19937 random{unsigned(GetParam())};
  const Bytes raw = content(GetParam(), 700'001, random);
  const Bytes packed = compressed(raw, {.shuffle = BLOSC_SHUFFLE, .typeSize = 4, .block = 262144});
  EXPECT_EQ(decompressed(packed, raw.size()), raw);
}

TEST_P(BloscBuffer, IsRefusedOrReadAsOtherContentIfDamaged) {
  std::mt19937 random{unsigned(GetParam())};
  const Bytes raw = content(GetParam(), 3000, random);
  const Bytes packed = compressed(raw, {.typeSize = 4});
  for (int n = 0; n < 300; ++n) {
    Bytes damaged = packed;
    for (int change = 0; change < 3; ++change)
      damaged[random() % damaged.size()] = std::byte(random() % 256);
    Bytes to(raw.size());
    try {
      (void)decompressBlosc(damaged, to, "x");
    } catch (const BadInput& error) {
      EXPECT_THAT(error.what(), testing::StartsWith("x: "));
    }
  }
}
INSTANTIATE_TEST_SUITE_P(Kinds, BloscBuffer, testing::Range(0, kKinds));

TEST(BloscBufferTest, IsRefusedIfItIsCutOff) {
  std::mt19937 random{1};
  const Bytes packed = compressed(content(5, 2000, random), {});
  Bytes to(2000);
  for (std::size_t size = 0; size < packed.size(); ++size)
    EXPECT_THROW(decompressBlosc(std::span(packed).first(size), to, "x"), BadInput);
}

TEST(BloscBufferTest, IsRefusedIfThereIsNoRoom) {
  std::mt19937 random{1};
  const Bytes packed = compressed(content(5, 2000, random), {});
  Bytes to(1999);
  EXPECT_THROW(decompressBlosc(packed, to, "x"), BadInput);
}

TEST(BloscBufferTest, RefusesOtherCompressorsByName) {
  std::mt19937 random{1};
  const Bytes packed = compressed(content(5, 2000, random), {.compressor = BLOSC_LZ4_COMPNAME});
  Bytes to(2000);
  try {
    (void)decompressBlosc(packed, to, "x");
    FAIL();
  } catch (const BadInput& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("another compressor of Blosc than Zstandard"));
  }
}

}  // namespace
}  // namespace esvr::decoder
