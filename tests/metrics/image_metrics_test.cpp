// Plan: PSNR and the largest difference are compared with values computed by hand. SSIM is compared
// with windows that are summed directly in float64. Means of products of values below 1 have errors
// of 1e-16 and are divided by C2 = 9e-4, so the tolerance is 1e-12. Constant pictures have closed
// forms. Alpha and colors outside the range of a screen do not count.
//
// FLIP agrees with values that make_flip_fixture.py computed from the paper's equations with
// two-dimensional kernels. The published implementation gives the same to 1e-8 in float64; it
// rounds the matrix from XYZ to nine digits. As the paper states, the largest difference is that of
// green and blue. Alpha and colors outside the range of a screen do not count.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "esvr/error.h"
#include "esvr/image_metrics.h"
#include "field/random_field.h"
#include "support/machine.h"

namespace esvr::test {
namespace {

// PSNR and SSIM.

Image constant(int width, int height, float color) {
  Image image{width, height, std::vector<float>(std::size_t(4 * width * height), color)};
  for (std::size_t i = 3; i < image.rgba.size(); i += 4) image.rgba[i] = 1.0f;
  return image;
}

Image noise(int width, int height, std::uint64_t seed) {
  Random random(seed);
  Image image = constant(width, height, 0.0f);
  for (float& v : image.rgba) v = float(random(0.0, 1.0));
  return image;
}

/// SSIM of one window by the definition, with variances as sums of squared differences.
double windowSsim(const Image& a, const Image& b, int cx, int cy, int channel) {
  double weights = 0.0, meanA = 0.0, meanB = 0.0;
  const auto overWindow = [&](auto&& visit) {
    for (int y = std::max(0, cy - 5); y <= std::min(a.height - 1, cy + 5); ++y)
      for (int x = std::max(0, cx - 5); x <= std::min(a.width - 1, cx + 5); ++x) {
        const int at = (y * a.width + x) * 4 + channel;
        const double r2 = std::pow(x - cx, 2) + std::pow(y - cy, 2);
        visit(std::exp(-r2 / (2 * 1.5 * 1.5)), double(a.rgba[at]), double(b.rgba[at]));
      }
  };
  overWindow([&](double w, double u, double v) { weights += w, meanA += w * u, meanB += w * v; });
  meanA /= weights, meanB /= weights;
  double varA = 0.0, varB = 0.0, covariance = 0.0;
  overWindow([&](double w, double u, double v) {
    varA += w / weights * (u - meanA) * (u - meanA);
    varB += w / weights * (v - meanB) * (v - meanB);
    covariance += w / weights * (u - meanA) * (v - meanB);
  });
  const double c1 = 1e-4, c2 = 9e-4;
  return (2 * meanA * meanB + c1) * (2 * covariance + c2) /
         ((meanA * meanA + meanB * meanB + c1) * (varA + varB + c2));
}

double directSsim(const Image& a, const Image& b) {
  double sum = 0.0;
  for (int y = 0; y < a.height; ++y)
    for (int x = 0; x < a.width; ++x)
      for (int c = 0; c < 3; ++c) sum += windowSsim(a, b, x, y, c);
  return sum / (3.0 * a.width * a.height);
}

TEST(ImageMetrics, APictureIsItself) {
  const Image image = noise(20, 15, 1);
  const ImageMetrics m = compareImages(image, image);
  EXPECT_EQ(m.psnr, std::numeric_limits<double>::infinity());
  EXPECT_NEAR(m.ssim, 1.0, 1e-12);
  EXPECT_EQ(m.maxError, 0.0);
}

TEST(ImageMetrics, ConstantPicturesHaveAClosedForm) {
  const ImageMetrics m = compareImages(constant(9, 30, 0.5f), constant(9, 30, 0.25f));
  EXPECT_NEAR(m.psnr, -20.0 * std::log10(0.25), 1e-12);
  EXPECT_NEAR(m.ssim, (2 * 0.5 * 0.25 + 1e-4) / (0.25 + 0.0625 + 1e-4), 1e-12);
  EXPECT_EQ(m.maxError, 0.25);
}

TEST(ImageMetrics, SsimIsTheMeanOfAllWindows) {
  for (const auto& [width, height] : {std::pair{23, 17}, {3, 40}, {1, 1}}) {
    const Image a = noise(width, height, 2), b = noise(width, height, 3);
    EXPECT_NEAR(compareImages(a, b).ssim, directSsim(a, b), 1e-11) << width;
  }
}

TEST(ImageMetrics, AlphaAndWhatNoScreenShowsDoNotCount) {
  const Image image = constant(12, 12, 1.0f);
  Image other = constant(12, 12, 1.5f);
  for (std::size_t i = 3; i < other.rgba.size(); i += 4) other.rgba[i] = 0.0f;
  EXPECT_EQ(compareImages(image, other).maxError, 0.0);
}

TEST(ImageMetrics, IsTheSameForAnyNumberOfThreads) {
  const Image a = noise(90, 130, 4), b = noise(90, 130, 5);
  const auto compare = [&] { return compareImages(a, b); };
  const ImageMetrics one = onThreads(1, compare), three = onThreads(3, compare);
  EXPECT_EQ(one.ssim, three.ssim);
  EXPECT_EQ(one.psnr, three.psnr);
}

TEST(ImageMetrics, WhatCannotBeComparedIsRefused) {
  EXPECT_THROW((void)compareImages(noise(3, 4, 1), noise(4, 3, 1)), UsageError);
  EXPECT_THROW((void)compareImages({}, {}), UsageError);
  Image broken = noise(3, 3, 1);
  broken.rgba[4] = std::nanf("");
  EXPECT_THROW((void)compareImages(broken, noise(3, 3, 1)), BadInput);
}

TEST(ErrorMap, ShowsTheLargestDifferenceOfAPixel) {
  Image a = constant(2, 1, 0.5f), b = a;
  b.rgba[5] = 0.25f;  // green channel of the second pixel
  const Image map = errorMap(a, b, 2.0);
  EXPECT_EQ(map.rgba, (std::vector<float>{0, 0, 0, 1, 0.5f, 0.5f, 0.5f, 1}));
  EXPECT_EQ(errorMap(a, b, 100.0).rgba[4], 1.0f);
}

TEST(SideBySide, PutsRowsTogether) {
  const Image a = constant(2, 2, 0.5f), b = constant(2, 2, 0.25f);
  const Image both = sideBySide(std::vector<Image>{a, b});
  EXPECT_EQ(both.width, 4);
  EXPECT_EQ(both.height, 2);
  EXPECT_EQ(both.rgba[0], 0.5f);
  EXPECT_EQ(both.rgba[8], 0.25f);
  EXPECT_EQ(both.rgba[16], 0.5f);
  EXPECT_EQ(both.rgba[24], 0.25f);
  EXPECT_THROW((void)sideBySide({}), UsageError);
  EXPECT_THROW((void)sideBySide(std::vector<Image>{a, constant(1, 2, 0.0f)}), UsageError);
}

// FLIP.

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
  expectSameOnAnyThreads([] { return flip(blocks(), noisyBlocks()).map; });
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
