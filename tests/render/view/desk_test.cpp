// Plan: the bytes of a message are compared with bytes written by hand; voxels with known values
// are counted, at the borders of parts of the range too.

#include "render/view/desk.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <numeric>

#include "render/view/outlet.h"

namespace esvr::view {
namespace {

using namespace std::string_literals;

// Messages.

TEST(BinaryMessage, HasItsHeadBetweenTheLengthAndTheBytes) {
  EXPECT_EQ(binaryMessage({{"id", 1}}, "\0xyz"s), "\x08\0\0\0{\"id\":1}\0xyz"s);
}

TEST(BinaryMessage, HasALengthOfSeveralBytes) {
  const std::string message = binaryMessage({{"x", std::string(0x12345, 'x')}}, "");
  EXPECT_EQ(message.substr(0, 4), "\x4d\x23\x01\0"s);  // 0x12345 and the 8 bytes {"x":""}
}

TEST(JsonText, ReplacesBytesThatAreNotUtf8) {
  EXPECT_EQ(textOf({{"name", "a\xff"}}), "{\"name\":\"a\xef\xbf\xbd\"}");
}

// Histograms.

/// A brick with these active values.
SparseVolume volumeOf(const std::vector<float>& values) {
  BrickInput brick;
  for (std::size_t i = 0; i < values.size(); ++i) {
    brick.values[i] = values[i];
    brick.active.set(int(i));
  }
  return makeVolume({brick}, 0.0f);
}

// The width of a part is 1, so that the borders are whole numbers and exact.
TEST(Histogram, CountsTheActiveValuesOfEachPart) {
  const auto counts =
      histogramOf(volumeOf({0.0f, 0.5f, 1.0f, 1.999f, 128.0f, 255.5f, 256.0f}), {0.0f, 256.0f});
  ASSERT_EQ(counts.size(), 256u);
  EXPECT_EQ(counts[0], 2u);
  EXPECT_EQ(counts[1], 2u);
  EXPECT_EQ(counts[128], 1u);
  EXPECT_EQ(counts[255], 2u);
  EXPECT_EQ(std::accumulate(counts.begin(), counts.end(), std::uint64_t{0}), 7u);
}

TEST(Histogram, CountsValuesOutsideTheRangeAtItsEnds) {
  const auto counts = histogramOf(volumeOf({-1e30f, 1e30f}), {0.0f, 1.0f});
  EXPECT_EQ(counts.front(), 1u);
  EXPECT_EQ(counts.back(), 1u);
}

TEST(Histogram, CountsAllValuesOnceIfTheyAreEqual) {
  EXPECT_EQ(histogramOf(volumeOf({3.0f, 3.0f}), {3.0f, 3.0f}).front(), 2u);
}

TEST(HistogramMessage, NamesItsPlace) {
  const auto content = nlohmann::json::parse(histogramMessage({2, 1, 7}, {0.5f, 2.0f}, {3, 4}));
  EXPECT_EQ(content, nlohmann::json::parse(R"({"type":"histogram","file":2,"grid":1,"frame":7,
      "histogram":{"low":0.5,"high":2.0,"counts":[3,4]}})"));
}

}  // namespace
}  // namespace esvr::view
