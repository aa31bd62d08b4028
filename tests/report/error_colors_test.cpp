// Plan: the tests check that larger errors have brighter colors, and that the scale has the colors
// of the map.

#include "report/error_colors.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace esvr::report {
namespace {

Image gray(const std::vector<float>& shares) {
  Image image{int(shares.size()), 1, {}};
  for (const float share : shares) image.rgba.insert(image.rgba.end(), {share, share, share, 1.0f});
  return image;
}

TEST(ErrorColors, areBrighterForLargerErrors) {
  std::vector<float> shares;
  for (int i = 0; i <= 100; ++i) shares.push_back(float(i) / 100.0f);
  Image map = gray(shares);
  colorErrors(map);
  double before = -1.0;
  for (std::size_t i = 0; i < map.rgba.size(); i += 4) {
    // The luma of ITU-R BT.601.
    const double luma = 0.299 * map.rgba[i] + 0.587 * map.rgba[i + 1] + 0.114 * map.rgba[i + 2];
    EXPECT_GT(luma, before) << i;
    EXPECT_EQ(map.rgba[i + 3], 1.0f);
    before = luma;
  }
}

TEST(ErrorColors, beginWithBlackAndEndWithTheLastColor) {
  Image map = gray({0.0f, 1.0f, 7.0f});
  colorErrors(map);
  EXPECT_EQ(map.rgba[0], 0.0f);
  EXPECT_EQ(map.rgba[4], 1.0f);
  EXPECT_EQ(map.rgba[6], map.rgba[10]) << "larger errors have the last color too";
}

TEST(ErrorScale, hasTheColorsOfTheMap) {
  // A quarter of the scale is the color of a sixteenth of the error, as colors follow its root.
  Image map = gray({1.0f / 16.0f});
  colorErrors(map);
  const auto level = [&](std::size_t c) {
    return std::to_string(int(map.rgba[c] * 255.0f + 0.5f));
  };
  EXPECT_THAT(errorScale().markup,
              testing::HasSubstr("offset=\"0.25\" stop-color=\"rgb(" + level(0) + "," + level(1) +
                                 "," + level(2) + ")\""));
}

}  // namespace
}  // namespace esvr::report
