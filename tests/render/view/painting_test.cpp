// Plan: two pictures of a few pixels, and results by hand.

#include "render/view/painting.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace esvr::view {
namespace {

using testing::ElementsAre;

/// Four pixels in a row, whose channels have one value each.
Image row(float r, float g, float b, float a) {
  Image image{4, 1, {}};
  for (int i = 0; i < image.width; ++i) image.rgba.insert(image.rgba.end(), {r, g, b, a});
  return image;
}

class ComparisonPicture : public testing::Test {
 protected:
  [[nodiscard]] Image shown(Comparison comparison) const {
    return comparisonPicture(row(0.5f, 0.25f, 0.0f, 0.5f), row(0.25f, 0.5f, 0.0f, 1.0f),
                             comparison);
  }
};

TEST_F(ComparisonPicture, ShowsTheGridOnTheLeftOfTheSplit) {
  for (const auto& [split, pixels] :
       std::vector<std::pair<double, int>>{{0.0, 0}, {0.25, 1}, {0.5, 2}, {0.6, 2}, {1.0, 4}}) {
    const Image image = shown({{}, CompareShow::kSplit, split, 1.0});
    for (int i = 0; i < 4; ++i)
      EXPECT_EQ(image.rgba[std::size_t(4 * i)], i < pixels ? 0.5f : 0.25f) << split << ' ' << i;
  }
}

TEST_F(ComparisonPicture, ShowsTheReferenceAlone) {
  EXPECT_EQ(shown({{}, CompareShow::kReference, 0.5, 1.0}).rgba, row(0.25f, 0.5f, 0.0f, 1.0f).rgba);
}

TEST_F(ComparisonPicture, ShowsOpaqueDifferencesWithTheirGain) {
  const Image image = shown({{}, CompareShow::kDifference, 0.5, 10.0});
  EXPECT_THAT((std::vector<float>(image.rgba.begin(), image.rgba.begin() + 4)),
              ElementsAre(2.5f, 2.5f, 0.0f, 1.0f));
}

}  // namespace
}  // namespace esvr::view
