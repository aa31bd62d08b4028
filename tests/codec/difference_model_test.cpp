// Plan: differences of any size come back, differences that are too large are refused, and running
// means approach what they are shown.

#include "codec/difference_model.h"

#include <gtest/gtest.h>

#include <vector>

namespace esvr::codec {
namespace {

constexpr std::int64_t kLargest = std::int64_t{1} << 36;

std::vector<std::int64_t> differencesOfAnySize() {
  std::vector<std::int64_t> differences{0};
  for (std::int64_t n : {1, 2, 3, 4, 5, 6, 100, 65535, 65536})
    differences.insert(differences.end(), {n, -n, 0});
  for (int bits = 17; bits <= 36; ++bits) {
    const std::int64_t power = std::int64_t{1} << bits;
    differences.insert(differences.end(), {power, -power, power - 1, 1 - power});
  }
  return differences;
}

TEST(DifferenceModel, BringsBackDifferencesOfAnySize) {
  const auto differences = differencesOfAnySize();
  for (std::size_t context = 0; context < DifferenceModel::kContexts; ++context) {
    Writer writer;
    DifferenceModel model;
    for (std::size_t i = 0; i < differences.size(); ++i)
      EXPECT_EQ(model.code(writer, context, i % DifferenceModel::kActivities, differences[i]),
                differences[i]);
    const auto bytes = writer.coder.finish();
    Reader reader{RangeDecoder(bytes)};
    DifferenceModel learnt;
    for (std::size_t i = 0; i < differences.size(); ++i)
      ASSERT_EQ(learnt.code(reader, context, i % DifferenceModel::kActivities, 0), differences[i]);
  }
}

TEST(DifferenceModel, RefusesDifferencesThatAreTooLarge) {
  for (const std::int64_t difference : {kLargest + 1, -kLargest - 1, kLargest << 20}) {
    Writer writer;
    DifferenceModel model;
    EXPECT_THROW((void)model.code(writer, 0, 0, difference), BadInput);
    const auto bytes = writer.coder.finish();
    Reader reader{RangeDecoder(bytes)};
    DifferenceModel learnt;
    EXPECT_THROW((void)learnt.code(reader, 0, 0, 0), BadInput);
  }
}

TEST(DifferenceModel, LearnsDifferencesOfOneContextApartFromOthers) {
  // After many zeros in context 0, a zero costs nearly nothing there, and a bit elsewhere.
  Writer writer;
  DifferenceModel model;
  for (int i = 0; i < 1000; ++i) (void)model.code(writer, 0, 0, 0);
  BitMeter there, elsewhere;
  (void)model.code(there, 0, 0, 0);
  (void)model.code(elsewhere, 1, 0, 0);
  EXPECT_LT(there.bits, 0.01);
  EXPECT_EQ(elsewhere.bits, 1.0);
}

TEST(DifferenceModel, HasAContextForEachOctave) {
  EXPECT_EQ(DifferenceModel::contextOf(0), 0u);
  EXPECT_EQ(DifferenceModel::contextOf(1), 1u);
  EXPECT_EQ(DifferenceModel::contextOf(4), 3u);
  EXPECT_EQ(DifferenceModel::contextOf(7), 3u);
  EXPECT_EQ(DifferenceModel::contextOf(~std::uint64_t{0}), DifferenceModel::kContexts - 1);
}

TEST(ExpectedMagnitude, ApproachesWhatItIsShown) {
  for (const std::uint64_t magnitude :
       {std::uint64_t{0}, std::uint64_t{1000}, std::uint64_t{1} << 40}) {
    ExpectedMagnitude expected(std::uint64_t{1} << 20);
    for (int i = 0; i < 2000; ++i) expected.learn(magnitude);
    // A mean moves by 1/32 of its distance, rounded to the nearest integer, so that it stays where
    // the distance is at most 16.
    EXPECT_NEAR(double(expected.mean()), double(magnitude), 16.0);
  }
}

TEST(ExpectedMagnitude, LimitsMagnitudes) {
  ExpectedMagnitude expected(0), limited(0);
  expected.learn(~std::uint64_t{0});
  limited.learn(std::uint64_t{1} << 48);
  EXPECT_EQ(expected.mean(), limited.mean());
}

}  // namespace
}  // namespace esvr::codec
