// Plan: two pictures of a few pixels are compared, and the results are known by hand. Pictures are encoded and decoded by
// libjpeg. With the best quality, smooth pictures come back within the rounding of JPEG's color transform and of its
// coefficients.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <jpeglib.h>

#include <cstdio>
#include <vector>

#include "esvr/error.h"
#include "render/view/jpeg_file.h"
#include "render/view/painting.h"

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

struct Decoded {
  unsigned width = 0, height = 0;
  std::vector<unsigned char> rgb;
};

Decoded decoded(const std::string& bytes) {
  jpeg_decompress_struct from{};
  jpeg_error_mgr errors{};
  from.err = jpeg_std_error(&errors);
  jpeg_create_decompress(&from);
  jpeg_mem_src(&from, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  jpeg_read_header(&from, boolean(1));
  jpeg_start_decompress(&from);
  Decoded image{from.output_width, from.output_height, {}};
  image.rgb.resize(std::size_t(3) * image.width * image.height);
  while (from.output_scanline < from.output_height) {
    JSAMPROW row = &image.rgb[std::size_t(3) * image.width * from.output_scanline];
    jpeg_read_scanlines(&from, &row, 1);
  }
  jpeg_finish_decompress(&from);
  jpeg_destroy_decompress(&from);
  return image;
}

/// Half transparent red, which becomes stronger to the right.
Image redRamp(int width, int height) {
  Image image{width, height, {}};
  for (int i = 0; i < width * height; ++i)
    image.rgba.insert(image.rgba.end(), {0.5f * float(i % width) / float(width), 0.0f, 0.0f, 0.5f});
  return image;
}

TEST(JpegFile, HasThePictureInFrontOfItsBackground) {
  const Decoded image = decoded(encodeJpeg(redRamp(33, 17), {{0.0, 0.0, 1.0}, 1.0}));
  ASSERT_EQ(image.width, 33u);
  ASSERT_EQ(image.height, 17u);
  for (unsigned y = 0; y < image.height; ++y)
    for (unsigned x = 0; x < image.width; ++x) {
      const unsigned char* const pixel = &image.rgb[std::size_t(3) * (y * image.width + x)];
      EXPECT_NEAR(pixel[0], 255.0 * 0.5 * x / 33.0, 4.0) << x << ' ' << y;
      EXPECT_NEAR(pixel[1], 0.0, 4.0) << x << ' ' << y;
      EXPECT_NEAR(pixel[2], 127.5, 4.0) << x << ' ' << y;
    }
}

TEST(JpegFile, IsLargerOfBetterQuality) {
  const Image image = redRamp(64, 64);
  EXPECT_LT(encodeJpeg(image, {{}, 0.2}).size(), encodeJpeg(image, {{}, 0.95}).size());
}

TEST(JpegFile, OfAPictureBeyondLibjpegsLimitIsRefusedWithItsText) {
  const Image image{65501, 1, std::vector<float>(std::size_t(4) * 65501)};
  EXPECT_THROW((void)encodeJpeg(image, {}), RuntimeFailure);
}

}  // namespace
}  // namespace esvr::view
