// Plan: FLIP agrees with values that make_flip_fixture.py computed from the paper's equations with
// two-dimensional kernels. The published implementation gives the same to 1e-8 in float64; it
// rounds the matrix from XYZ to nine digits. As the paper states, the largest difference is that of
// green and blue. Alpha and colors outside the range of a screen do not count.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>

#include "esvr/error.h"
#include "esvr/image_metrics.h"
#include "support/on_threads.h"

namespace esvr::test {
namespace {

constexpr int kWidth = 40, kHeight = 28, kBlock = 4;

/// The same function as in make_flip_fixture.py. Its values are multiples of 2^-24 and exact in
/// float32.
double hashed(std::uint64_t index) {
  return double((index * 2654435761u % (std::uint64_t{1} << 32)) >> 8) / (1 << 24);
}

double blockColor(int x, int y, int c) {
  return hashed(std::uint64_t(((y / kBlock) * 100 + x / kBlock) * 3 + c));
}

template <class ColorAt>
Image pictureOf(int width, int height, const ColorAt& colorAt) {
  Image image{width, height, {}};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < 3; ++c) image.rgba.push_back(float(colorAt(x, y, c)));
      image.rgba.push_back(1.0f);
    }
  return image;
}

Image blocks() { return pictureOf(kWidth, kHeight, blockColor); }

Image noisyBlocks() {
  return pictureOf(kWidth, kHeight, [](int x, int y, int c) {
    const double noise = hashed(std::uint64_t(1000003 + (y * kWidth + x) * 3 + c));
    return 0.75 * blockColor(x, y, c) + 0.25 * noise;
  });
}

Image uniform(double r, double g, double b) {
  return pictureOf(12, 9, [&](int, int, int c) { return c == 0 ? r : c == 1 ? g : b; });
}

struct Known {
  double pixelsPerDegree, mean, max, first, middle;
};

class FlipFixture : public testing::TestWithParam<Known> {};

// Both sides sum some hundred products in float64, so 1e-9 leaves room for the order of sums. The
// map is float32: 1e-7.
TEST_P(FlipFixture, agreesWithThePapersEquations) {
  const Known& known = GetParam();
  const Flip error = flip(blocks(), noisyBlocks(), known.pixelsPerDegree);
  EXPECT_NEAR(error.mean, known.mean, 1e-9);
  EXPECT_NEAR(error.max, known.max, 1e-9);
  EXPECT_NEAR(error.map[0], known.first, 1e-7);
  EXPECT_NEAR(error.map[13 * kWidth + 21], known.middle, 1e-7);
}

INSTANTIATE_TEST_SUITE_P(All, FlipFixture,
                         testing::Values(Known{kFlipPixelsPerDegree, 0.3126858444956412,
                                               0.6771773055618261, 0.35360314654768166,
                                               0.21439748103647918},
                                         Known{20.0, 0.43160538512430185, 0.9067481573088745,
                                               0.3665421707424408, 0.3552438718641101}));

TEST(Flip, isOneBetweenGreenAndBlueAndLessBetweenOthers) {
  EXPECT_NEAR(flip(uniform(0, 1, 0), uniform(0, 0, 1)).mean, 1.0, 1e-9);
  EXPECT_LT(flip(uniform(0, 0, 0), uniform(1, 1, 1)).mean, 1.0);
  EXPECT_LT(flip(uniform(1, 0, 0), uniform(0, 1, 0)).mean, 1.0);
}

TEST(Flip, isZeroForAPictureAndItself) {
  const Flip error = flip(blocks(), blocks());
  EXPECT_EQ(error.mean, 0.0);
  EXPECT_EQ(error.max, 0.0);
}

TEST(Flip, doesNotSeeAlphaNorWhatNoScreenShows) {
  const Image image = uniform(1.0, 0.0, 0.5);
  Image other = uniform(1.5, -0.5, 0.5);
  for (std::size_t i = 3; i < other.rgba.size(); i += 4) other.rgba[i] = 0.25f;
  EXPECT_EQ(flip(image, other).max, 0.0);
}

TEST(Flip, isTheSameForAnyNumberOfThreads) {
  const auto map = [] { return flip(blocks(), noisyBlocks()).map; };
  EXPECT_EQ(onThreads(1, map), onThreads(3, map));
}

TEST(Flip, refusesWhatCannotBeCompared) {
  EXPECT_THROW((void)flip(blocks(), uniform(0, 0, 0)), UsageError);
  EXPECT_THROW((void)flip({}, {}), UsageError);
  EXPECT_THROW((void)flip(blocks(), blocks(), 0.0), UsageError);
  Image broken = uniform(0, 0, 0);
  broken.rgba[4] = std::nanf("");
  EXPECT_THROW((void)flip(uniform(0, 0, 0), broken), BadInput);
}

}  // namespace
}  // namespace esvr::test
