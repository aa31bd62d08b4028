// Plan: the decoder returns what was encoded, nearly certain decisions take almost no bits, and
// carries propagate through any number of bytes.

#include "codec/range_coder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

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

}  // namespace
}  // namespace esvr::codec
