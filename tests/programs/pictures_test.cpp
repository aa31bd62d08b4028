// Plan: bars of known colors are drawn into pictures of many sizes. The tests look for the colors in the columns of the bar,
// and check that nothing outside the right edge changes, that the size of the bar follows the height of the picture, and
// that any text and any range can be drawn.
//
// Scripts that stand for ffmpeg keep what they read, fail, end early or wait. The tests check the pixels that they get,
// the messages, and that nothing is left of a video that is not complete. Where ffmpeg is installed, a video is also
// encoded and decoded again.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

#include "cli/run_program.h"
#include "esvr/error.h"
#include "programs/pictures.h"
#include "programs/video_file.h"
#include "support/files.h"

namespace esvr::report {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// Bars of colors.

/// Red at low values and blue at high ones; low values are transparent.
ColorBar redAndBlue() {
  return {.name = "density", .unit = "kg/m\u00b3", .shades = {{{1, 0, 0}, 0.0}, {{0, 0, 1}, 1.0}}};
}

Image transparent(int width, int height) {
  return {width, height, std::vector<float>(std::size_t(width) * std::size_t(height) * 4)};
}

using Pixel = std::array<float, 4>;
Pixel at(const Image& image, int x, int y) {
  const float* p = &image.rgba[4 * (std::size_t(y) * std::size_t(image.width) + std::size_t(x))];
  return {p[0], p[1], p[2], p[3]};
}
const Pixel kRed{1, 0, 0, 1}, kBlue{0, 0, 1, 1};

/// Number of the pixels of a row that have a color.
int countInRow(const Image& image, int y, const Pixel& color) {
  int count = 0;
  for (int x = 0; x < image.width; ++x) count += at(image, x, y) == color;
  return count;
}

TEST(ColorBar, hasItsColorsWithAndWithoutTheirOpacity) {
  Image image = transparent(400, 400);
  drawColorBar(redAndBlue(), image);
  // Blue is opaque in both columns. Red is shown in the column of colors only.
  const int blue = countInRow(image, 150, kBlue), red = countInRow(image, 250, kRed);
  EXPECT_GT(red, 5);
  EXPECT_GT(blue, red + 3);
  EXPECT_EQ(countInRow(image, 150, kRed), 0);
  EXPECT_EQ(countInRow(image, 250, kBlue), 0);
}

TEST(ColorBar, changesTheRightEdgeOnly) {
  const ColorBar bar = redAndBlue();
  Image image = transparent(300, 200);
  drawColorBar(bar, image);
  const int left = int(300 * (1.0 - colorBarShare(bar, 300, 200))) - 1;
  bool changed = false;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const bool same = at(image, x, y) == Pixel{};
      ASSERT_TRUE(same || x >= left) << x << ", " << y;
      changed |= !same;
    }
  EXPECT_TRUE(changed);
}

TEST(ColorBar, isAsLargeAsThePictureDemands) {
  const ColorBar bar = redAndBlue();
  const double share = colorBarShare(bar, 800, 800);
  EXPECT_LT(share, 0.25);
  EXPECT_NEAR(colorBarShare(bar, 8000, 8000), share, 0.01);
  EXPECT_NEAR(colorBarShare(bar, 1600, 800), share / 2, 0.01);
  EXPECT_LE(colorBarShare(bar, 100, 2000), kMaxBarShare);
}

TEST(ColorBar, leavesIllegibleTextsOut) {
  ColorBar bar = redAndBlue(), other = bar;
  other.name = "ytisned";  // has the same width
  const auto drawn = [](const ColorBar& b, int side) {
    Image image = transparent(side, side);
    drawColorBar(b, image);
    return image.rgba;
  };
  EXPECT_NE(drawn(bar, 400), drawn(other, 400));
  EXPECT_EQ(drawn(bar, 100), drawn(other, 100));
}

TEST(ColorBar, fitsIntoAnyPicture) {
  for (const auto& [width, height] :
       {std::pair{1, 1}, {2, 1}, {1, 300}, {300, 1}, {16, 16}, {64, 48}, {7, 999}, {999, 7}}) {
    Image image = transparent(width, height);
    EXPECT_NO_THROW(drawColorBar(redAndBlue(), image)) << width << " x " << height;
    for (const float value : image.rgba) ASSERT_TRUE(value >= 0.0f && value <= 1.0f);
  }
}

TEST(ColorBar, takesAnyTextAndRange) {
  const std::string longName(500, 'x'), notUtf8 = "\xff\n\x1b\xe2\x82";
  constexpr double kHuge = std::numeric_limits<double>::max();
  for (const std::string& text : {longName, notUtf8, std::string()})
    for (const auto& [low, high] :
         {std::pair{0.0, 0.0}, {5.0, 5.0}, {-kHuge, kHuge}, {1e-30, 2e-30}}) {
      Image image = transparent(200, 200);
      const ColorBar bar{.name = text, .unit = text, .low = low, .high = high};
      EXPECT_NO_THROW(drawColorBar(bar, image));
      EXPECT_LE(colorBarShare(bar, 200, 200), kMaxBarShare);
    }
}

TEST(ColorBar, hasInkThatContrastsWithTheBackground) {
  const auto darkest = [](const std::array<double, 3>& background) {
    ColorBar bar = redAndBlue();
    bar.background = background;
    Image image = transparent(400, 400);
    for (std::size_t i = 0; i < image.rgba.size(); ++i)
      image.rgba[i] = i % 4 == 3 ? 1.0f : float(background[i % 4]);
    drawColorBar(bar, image);
    float least = 1.0f, most = 0.0f;
    for (int y = 0; y < 80; ++y)  // above the bar
      for (int x = 250; x < 400; ++x) {
        least = std::min(least, at(image, x, y)[1]);
        most = std::max(most, at(image, x, y)[1]);
      }
    return std::pair{least, most};
  };
  EXPECT_LT(darkest({1, 1, 1}).first, 0.4f);
  EXPECT_GT(darkest({0, 0, 0}).second, 0.6f);
}

using Labels = std::vector<std::string>;

Labels roundLabels(double low, double high, double most) {
  Labels texts;
  for (const Tick& tick : roundTicks(low, high, most)) texts.push_back(tick.label);
  return texts;
}

TEST(RoundTicks, includeTheEndsThatAreRound) {
  EXPECT_EQ(roundLabels(0.0, 1.0, 5.0), (Labels{"0", "0.2", "0.4", "0.6", "0.8", "1.0"}));
  EXPECT_EQ(roundLabels(-3.0, 3.0, 7.0), (Labels{"-3", "-2", "-1", "0", "1", "2", "3"}));
  EXPECT_EQ(roundLabels(double(0.1f), double(0.3f), 4.0),
            (Labels{"0.10", "0.15", "0.20", "0.25", "0.30"}));
}

TEST(RoundTicks, canBeDistinguishedInNarrowRanges) {
  EXPECT_EQ(roundLabels(1000.0001, 1000.0009, 4.0),
            (Labels{"1.0000002e+03", "1.0000004e+03", "1.0000006e+03", "1.0000008e+03"}));
  EXPECT_EQ(roundLabels(0.0, 5e-6, 5.0),
            (Labels{"0", "1e-06", "2e-06", "3e-06", "4e-06", "5e-06"}));
  EXPECT_EQ(roundLabels(0.0, 3e7, 3.0), (Labels{"0", "1e+07", "2e+07", "3e+07"}));
}

TEST(RoundTicks, areThereForAnyRange) {
  EXPECT_EQ(roundLabels(0.25, 0.25, 5.0), (Labels{"0.25"}));
  EXPECT_EQ(roundTicks(1.0, std::nextafter(1.0, 2.0), 5.0).size(), 1u)
      << "no room for round numbers";
  EXPECT_EQ(roundTicks(-1.7e308, 1.7e308, 5.0).size(), 1u) << "the range is not finite";
}

// Videos.

Image uniform(int side, std::array<float, 4> rgba) {
  Image image{side, side, {}};
  for (int i = 0; i < side * side; ++i)
    image.rgba.insert(image.rgba.end(), rgba.begin(), rgba.end());
  return image;
}

class Video : public testing::Test {
 protected:
  /// Writes pictures of one color to a video. \param side  an even number
  void write(int side, int pictures, const std::string& name = "out.mp4") {
    VideoForm form;
    form.width = form.height = side;
    form.background = {0.0, 1.0, 1.0};
    VideoFile video(folder_ / name, form, cancel_);
    for (int i = 0; i < pictures; ++i) video.add(uniform(side, {0.4f, 0.0f, 0.2f, 0.5f}));
    video.finish();
  }
  /// Expects that a script as ffmpeg makes writing fail with a message.
  template <class Failure>
  void expectFailure(const std::string& script, const std::string& why) {
    path_.add("ffmpeg", script);
    try {
      write(256, 4);  // more bytes than a socket holds
      ADD_FAILURE() << "no failure of " << script;
    } catch (const Failure& failure) {
      EXPECT_THAT(failure.what(), HasSubstr(why));
    }
    EXPECT_THAT(folder_.names(), IsEmpty()) << script;
  }

  test::TemporaryFolder folder_;
  test::SearchPath path_;
  CancelToken cancel_;
};

TEST_F(Video, passesThePixelsInFrontOfTheBackground) {
  path_.add("ffmpeg", std::string(test::kOutputOfFfmpeg) + "cat > \"$out\"");
  write(2, 3);
  // 0.4 is level 102, 0 and 0.2 are in front of half of 1: 127.5 and 178.5, which are rounded up.
  const std::string pixel("\x66\x80\xb3");
  std::string expected;
  for (int i = 0; i < 2 * 2 * 3; ++i) expected += pixel;
  EXPECT_EQ(test::readText(folder_ / "out.mp4"), expected);
  EXPECT_THAT(folder_.names(), ElementsAre("out.mp4"));
}

TEST_F(Video, asksForTheCodecOfItsName) {
  path_.add("ffmpeg",
            std::string(test::kOutputOfFfmpeg) + "cat > /dev/null; echo \"$@\" > \"$out\"");
  write(2, 1, "out.mp4");
  write(2, 1, "out.webm");
  EXPECT_THAT(test::readText(folder_ / "out.mp4"), test::Says("libx264", "-framerate 30 ", "2x2"));
  EXPECT_THAT(test::readText(folder_ / "out.webm"), HasSubstr("libvpx-vp9"));
}

TEST_F(Video, failsWithTheLastMessageOfFfmpeg) {
  expectFailure<RuntimeFailure>("cat > /dev/null; echo first >&2; echo last words >&2; exit 1",
                                "out.mp4: ffmpeg: last words");
  expectFailure<RuntimeFailure>("echo no codec >&2; exit 1", "no codec");
}

TEST_F(Video, saysHowFfmpegEndedWithoutAMessage) {
  expectFailure<RuntimeFailure>("cat > /dev/null; exit 3", "code 3");
  expectFailure<RuntimeFailure>("kill -9 $$", "signal 9");
  expectFailure<RuntimeFailure>("exit 0", "before it had read all pictures");
  expectFailure<RuntimeFailure>("cat > /dev/null", "wrote nothing");
}

TEST_F(Video, doesNotWaitForMessagesToBeRead) {
  expectFailure<RuntimeFailure>(
      "head -c 300000 /dev/zero | tr '\\0' '\\n' >&2; cat > /dev/null; echo end >&2; exit 1",
      "end");
}

TEST_F(Video, endsAnFfmpegThatWaitsWhereItIsCancelled) {
  cancel_.cancel();
  expectFailure<Cancelled>("exec sleep 60", "cancelled");
}

TEST_F(Video, needsFfmpeg) {
  path_.hideOthers();
  EXPECT_THROW(write(2, 1), UsageError);
  EXPECT_THAT(folder_.names(), IsEmpty());
}

TEST_F(Video, needsEvenSides) {
  EXPECT_NO_THROW(checkVideoSize(32766, 2));
  EXPECT_THROW(checkVideoSize(33, 32), UsageError);
  EXPECT_THROW(checkVideoSize(32, 33), UsageError);
}

/// The pictures of a video as bytes of red, green and blue, decoded by ffmpeg.
std::string decoded(const std::string& file) {
  FILE* pipe = popen(("ffmpeg -v error -i " + file + " -f rawvideo -pix_fmt rgb24 -").c_str(), "r");
  std::string bytes;
  for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) bytes.push_back(char(c));
  EXPECT_EQ(pclose(pipe), 0);
  return bytes;
}

TEST_F(Video, SlowVideoOfRealFfmpegHasItsPicturesAndColors) {
  if (!findProgram("ffmpeg")) GTEST_SKIP() << "ffmpeg is not installed";
  constexpr int kSide = 32, kPictures = 3, kColors = 3;
  // 8-bit BT.709 has about 219 levels of brightness, and ffmpeg's conversions round twice.
  constexpr int kTolerance = 4;
  const std::array expected{0x66, 0x80, 0xb3};
  for (const char* name : {"out.mp4", "out.webm"}) {
    write(kSide, kPictures, name);
    const std::string pixels = decoded(folder_ / name);
    ASSERT_EQ(pixels.size(), std::size_t(kSide * kSide * kPictures * kColors)) << name;
    for (std::size_t c = 0; c < expected.size(); ++c)
      EXPECT_NEAR(std::uint8_t(pixels[c]), expected[c], kTolerance) << name;
  }
}

}  // namespace
}  // namespace esvr::report
