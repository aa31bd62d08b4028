// Plan: functions of built-in parts are found over any range; one changed point is noticed.

#include "render/view/command_text.h"

#include <gtest/gtest.h>

namespace esvr::view {
namespace {

TEST(LookNames, AreFoundOverAnyRange) {
  for (const ValueRange range : {ValueRange{0.0f, 1.0f}, ValueRange{-3.5f, 1e6f}}) {
    const auto names =
        namesOf(rescaled({builtInColorMap("inferno"), builtInOpacity("linear")}, range));
    ASSERT_TRUE(names);
    EXPECT_EQ(names->colors, "inferno");
    EXPECT_EQ(names->opacity, "linear");
    EXPECT_EQ(names->range.min, range.min);
    EXPECT_EQ(names->range.max, range.max);
  }
}

TEST(LookNames, AreNoneIfOnePointIsChanged) {
  TransferFunction f{builtInColorMap("viridis"), builtInOpacity("linear")};
  ASSERT_TRUE(namesOf(f));
  TransferFunction other = f;
  other.opacity.back().opacity -= 0.01;
  EXPECT_FALSE(namesOf(other));
  other = f;
  other.colors.points[1].color.g += 0.01;
  EXPECT_FALSE(namesOf(other));
  other = f;
  other.colors.points.front().x -= 0.01;
  EXPECT_FALSE(namesOf(other));
}

}  // namespace
}  // namespace esvr::view
