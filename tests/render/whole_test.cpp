// Plan: the functions agree with floor and ceil at whole numbers, halves and their neighbours of
// both signs.
#include "render/whole.h"

#include <gtest/gtest.h>

namespace esvr::test {
namespace {

TEST(Whole, IsFloorAndCeil) {
  for (int i = -1000; i <= 1000; ++i)
    for (const float v : {float(i) / 2.0f, std::nextafter(float(i), -1e9f),
                          std::nextafter(float(i), 1e9f), float(i) * 997.0f}) {
      EXPECT_EQ(wholeBelow(v), int(std::floor(v))) << v;
      EXPECT_EQ(wholeAbove(v), int(std::ceil(v))) << v;
      EXPECT_EQ(wholeNearest(v), int(std::nearbyint(v))) << v;
      EXPECT_NEAR(float(wholePart(v).whole) + wholePart(v).left, v, 1e-7 * (1.0 + std::abs(v)));
    }
}

TEST(Whole, RangesAreWithinOthers) {
  const auto expectRange = [](float low, float high, int first, int last) {
    const WholeRange r = wholeWithin(low, high, {2, 9});
    EXPECT_EQ(r.first, first) << low << " " << high;
    EXPECT_EQ(r.last, last) << low << " " << high;
  };
  expectRange(3.2f, 6.8f, 4, 6);
  expectRange(3.0f, 7.0f, 3, 7);
  expectRange(-1e9f, 1e9f, 2, 9);
  expectRange(3.2f, 3.8f, 4, 3);
  expectRange(20.0f, 30.0f, 10, 9);
  expectRange(-30.0f, -20.0f, 2, 1);
}

}  // namespace
}  // namespace esvr::test
