// Plan: a reader returns what was written, over several parts and from streams that end anywhere. Shares stay valid
// however one-sided the symbols are, and a meter tells what a writer writes.

#include "codec/symbol_coder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace esvr::codec {
namespace {

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

}  // namespace
}  // namespace esvr::codec
