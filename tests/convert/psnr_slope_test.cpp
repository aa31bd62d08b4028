// Plan: the slope between two fits is the gain by twice the ellipsoids, whichever fit comes first.
// Fits that are too close to each other give the usual slope, and noise is limited.

#include "convert/psnr_slope.h"

#include <gtest/gtest.h>

namespace esvr::convert {
namespace {

TEST(PsnrSlope, IsTheGainByTwiceTheEllipsoids) {
  EXPECT_DOUBLE_EQ(dbPerDoubling({1000, 40}, {2000, 46}), 6.0);
  EXPECT_DOUBLE_EQ(dbPerDoubling({1000, 40}, {4000, 46}), 3.0);
  EXPECT_DOUBLE_EQ(dbPerDoubling({4000, 46}, {1000, 40}), 3.0);
}

TEST(PsnrSlope, IsTheUsualOneBetweenFitsOfAboutAsManyEllipsoids) {
  EXPECT_DOUBLE_EQ(dbPerDoubling({1000, 40}, {1000, 41}), kDbPerDoubling);
  EXPECT_DOUBLE_EQ(dbPerDoubling({1000, 40}, {1100, 41}), kDbPerDoubling);
}

TEST(PsnrSlope, IsLimited) {
  EXPECT_DOUBLE_EQ(dbPerDoubling({1000, 40}, {2000, 39}), kMinDbPerDoubling);
  EXPECT_DOUBLE_EQ(dbPerDoubling({1000, 40}, {2000, 70}), kMaxDbPerDoubling);
}

TEST(PsnrSlope, GivesTheNumberThatReachesAPsnr) {
  EXPECT_DOUBLE_EQ(countFor({1000, 40}, 46, 6.0), 2000.0);
  EXPECT_DOUBLE_EQ(countFor({1000, 40}, 34, 6.0), 500.0);
}

}  // namespace
}  // namespace esvr::convert
