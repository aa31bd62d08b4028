// Plan: the decoder returns what was encoded, nearly certain decisions take almost no bits, and
// carries propagate through any number of bytes.
//
// Bytes of all kinds come back, also from a stream without its zeros and with zeros after it. Records, texts
// and lists of positions become as small as measured; noise hardly grows. Anything else is decoded, too, to as many
// bytes as were asked for.
//
// A reader returns what was written, over several parts and from streams that end anywhere. Shares stay valid
// however one-sided the symbols are, and a meter tells what a writer writes.
//
// Sorted keys come back from the tree of cells, in which their order takes no bits. A damaged split is refused.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "codec/brick_coder.h"
#include "codec/range_coder.h"
#include "codec/symbol_coder.h"

namespace esvr::codec {
namespace {

TEST(RangeCoder, GivesBackDecisionsOfAnyProbability) {
  std::mt19937 engine(1);
  for (const std::uint32_t ones : {0u, 1u, 30u, 500u, 999u, 1000u}) {
    std::vector<bool> bits;
    for (int i = 0; i < 20'000; ++i) bits.push_back(engine() % 1000 < ones);
    RangeEncoder encoder;
    BitModel model;
    for (const bool bit : bits) encoder.bit(model, bit);
    const auto bytes = encoder.finish();
    RangeDecoder decoder(bytes);
    BitModel learnt;
    for (std::size_t i = 0; i < bits.size(); ++i) ASSERT_EQ(decoder.bit(learnt), bits[i]) << i;
    // The entropy, plus the cost of learning and of a smallest probability of 1/2048.
    const double p = double(ones) / 1000.0;
    const double entropy = p > 0.0 && p < 1.0 ? -p * std::log2(p) - (1 - p) * std::log2(1 - p) : 0;
    EXPECT_LT(double(bytes.size()) * 8.0, 20'000 * (entropy * 1.02 + 0.005) + 64);
  }
}

TEST(RangeCoder, BecomesSureOfDecisionsThatAreAlwaysTheSame) {
  for (const bool bit : {false, true}) {
    RangeEncoder encoder;
    BitModel model;
    constexpr int kDecisions = 1'000'000;
    for (int i = 0; i < kDecisions; ++i) encoder.bit(model, bit);
    // Learning takes about log2(100) + 3 bits, and the end of the stream at most 32. Steps end when
    // the probability of the other decision is below 101 / 2^22, which costs 0.000035 bits.
    EXPECT_LT(double(encoder.finish().size()) * 8.0, 10 + 32 + kDecisions * 0.000035);
  }
}

TEST(RangeCoder, CarriesThroughRunsOfOnes) {
  // Decisions that keep the lower end of the interval just below a power of two.
  RangeEncoder encoder;
  std::vector<std::uint32_t> values;
  for (std::uint32_t i = 0; i < 500; ++i) values.push_back(i % 50 == 49 ? 0u : 0xffffu);
  for (const auto v : values) encoder.raw(v, 16);
  const auto bytes = encoder.finish();
  RangeDecoder decoder(bytes);
  for (const auto v : values) ASSERT_EQ(decoder.raw(16), v);
}

TEST(RangeCoder, ReadsZerosBeyondTheEnd) {
  RangeDecoder decoder({});
  EXPECT_EQ(decoder.raw(32), 0u);
}

TEST(NumberModel, GivesBackNumbersOfAnySize) {
  std::vector<std::uint32_t> numbers{0, 1, 2, 3, 7, 8, 0x7fffffff, 0x40000000, 12345, 0};
  Writer writer;
  NumberModel model;
  for (const auto n : numbers) EXPECT_EQ(model.code(writer, n), n);
  const auto bytes = writer.coder.finish();
  Reader reader{RangeDecoder(bytes)};
  NumberModel learnt;
  for (const auto n : numbers) EXPECT_EQ(learnt.code(reader, 0u), n);
}

// ---- Bytes

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

// ---- Symbols

/// Codes steps of all kinds. \return the numbers that were coded
template <class Side>
std::vector<std::uint32_t> codeSteps(Side& side, const std::vector<std::uint32_t>& numbers) {
  SymbolModel symbols, four(4);
  BitModel bits;
  std::vector<std::uint32_t> coded;
  const auto wanted = [&](std::uint32_t mask) {
    return coded.size() < numbers.size() ? numbers[coded.size()] & mask : 0u;
  };
  for (int n = 0; n < 3000; ++n) {
    if (n % 1000 == 999) {
      if constexpr (requires { side.beginPart(); })
        side.beginPart();
      else
        side.endPart();
    }
    coded.push_back(side.symbol(symbols, wanted(15)));
    coded.push_back(side.symbol(four, wanted(3)));
    coded.push_back(side.bit(bits, wanted(1) != 0));
    const int count = n % kMostRawBits + 1;
    coded.push_back(side.raw(wanted((1u << count) - 1u), count));
  }
  return coded;
}

std::vector<std::uint32_t> randomNumbers(std::uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<std::uint32_t> numbers(12'000);
  // Most numbers are small.
  for (auto& n : numbers) n = std::uint32_t(random()) >> (random() % 32);
  return numbers;
}

TEST(SymbolCoder, GivesBackStepsOfAllKinds) {
  const auto numbers = randomNumbers(1);
  SymbolWriter writer(numbers.size());
  const auto written = codeSteps(writer, numbers);
  writer.endPart();
  const auto bytes = writer.bytes();
  SymbolReader reader(bytes);
  reader.beginPart();
  EXPECT_EQ(codeSteps(reader, {}), written);
}

TEST(SymbolCoder, ReadsOnWhereAStreamEnds) {
  const auto numbers = randomNumbers(2);
  SymbolWriter writer(numbers.size());
  (void)codeSteps(writer, numbers);
  writer.endPart();
  const auto bytes = writer.bytes();
  for (std::size_t size = 0; size < bytes.size(); size = size * 3 / 2 + 1) {
    const std::vector<std::byte> part(bytes.begin(), bytes.begin() + std::ptrdiff_t(size));
    SymbolReader reader(part);
    reader.beginPart();
    for (const std::uint32_t n : codeSteps(reader, {})) ASSERT_LE(n, 0xffffu);
  }
}

TEST(SymbolCoder, MetersWhatIsWritten) {
  const auto numbers = randomNumbers(3);
  SymbolWriter writer(numbers.size());
  SymbolMeter meter;
  EXPECT_EQ(codeSteps(meter, numbers), codeSteps(writer, numbers));
  writer.endPart();
  meter.endPart();
  const double bytes = double(writer.bytes().size());
  EXPECT_NEAR(double(meter.bytes()), bytes, 0.002 * bytes + 8.0);
}

TEST(SymbolCoder, BecomesSureOfWhatIsAlwaysTheSame) {
  for (const std::uint32_t symbol : {0u, 7u, 15u}) {
    SymbolMeter meter;
    SymbolModel model;
    constexpr int kCount = 1'000'000;
    for (int n = 0; n < kCount; ++n) (void)meter.symbol(model, symbol);
    // 15 other symbols keep a share of 2^-16 each, which costs 0.00035 bits.
    EXPECT_LT(double(meter.bytes()) * 8.0, 60.0 + kCount * 0.0004) << symbol;
  }
}

TEST(SymbolModel, KeepsAShareForEachSymbol) {
  std::mt19937 random(4);
  for (const std::int32_t symbols : {1, 2, 3, 4, 8, 16}) {
    SymbolModel model(symbols);
    for (int n = 0; n < 4000; ++n) {
      // Long runs of a symbol, after which another one follows.
      model.learn(n % 1000 == 0 ? std::uint32_t(random() % 16) : std::uint32_t(n / 1000));
      std::uint32_t sum = 0;
      for (std::uint32_t s = 0; s < 16; ++s) {
        ASSERT_EQ(model.of(s).start, sum);
        ASSERT_GT(model.of(s).share, 0u);
        sum += model.of(s).share;
      }
      ASSERT_EQ(sum, kWholeShare);
    }
    for (std::uint32_t s = 0; s < 16; ++s) {
      const SymbolShare share = model.of(s);
      EXPECT_EQ(model.at(share.start), s);
      EXPECT_EQ(model.at(share.start + share.share - 1), s);
    }
  }
}

// ---- Bricks

std::vector<std::uint64_t> throughTheTree(std::vector<std::uint64_t> keys, int bits,
                                          std::size_t& size) {
  std::sort(keys.begin(), keys.end());
  Writer writer;
  CellTree<Writer>(writer).code(keys, bits);
  const auto bytes = writer.coder.finish();
  size = bytes.size();
  std::vector<std::uint64_t> back(keys.size());
  Reader reader{RangeDecoder(bytes)};
  CellTree<Reader>(reader).code(back, bits);
  EXPECT_EQ(back, keys);
  return back;
}

TEST(CellTree, GivesBackSortedKeys) {
  std::mt19937_64 engine(2);
  std::size_t size = 0;
  for (const int bits : {0, 3, 21, 60})
    for (const std::size_t n : {0u, 1u, 2u, 15u, 16u, 17u, 4096u}) {
      std::vector<std::uint64_t> keys(n);
      for (auto& key : keys) key = bits == 0 ? 0 : engine() >> (64 - bits);
      (void)throughTheTree(keys, bits, size);
    }
}

TEST(CellTree, PaysNothingForTheOrder) {
  std::mt19937_64 engine(3);
  std::vector<std::uint64_t> keys(4096);
  for (auto& key : keys) key = engine() >> 43;
  std::size_t size = 0;
  (void)throughTheTree(keys, 21, size);
  // log2 of the number of multisets is n (21 - log2 n + log2 e) bits; 5.4 % more are allowed.
  EXPECT_LT(double(size) * 8.0, 4096 * (21 - 12 + 1.4427) * 1.054);
}

TEST(CellTree, RefusesASplitOfMoreThanThereAre) {
  // 3 keys need numbers from 0 to 3, but the number has 4 bits, so ones are read as 15.
  RangeEncoder encoder;
  for (int i = 0; i < 200; ++i) encoder.raw(1, 1);
  const auto bytes = encoder.finish();
  std::vector<std::uint64_t> keys(3);
  Reader reader{RangeDecoder(bytes)};
  CellTree<Reader> tree(reader);
  EXPECT_THROW(tree.code(keys, 10), BadInput);
}

}  // namespace

}  // namespace esvr::codec
