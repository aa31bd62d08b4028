// Plan: the decoder returns what was encoded, nearly certain decisions take almost no bits, and
// carries propagate through any number of bytes.

#include "codec/symbol_coder.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "codec/cell_tree.h"

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
