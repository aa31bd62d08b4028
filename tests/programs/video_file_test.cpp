// Plan: scripts that stand for ffmpeg keep what they read, fail, end early or wait. The tests
// check the pixels that they get, the messages, and that nothing is left of a video that is not
// complete. Where ffmpeg is installed, a video is also encoded and decoded again.

#include "programs/video_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdio>

#include "cli/run_program.h"
#include "esvr/error.h"
#include "support/search_path.h"

namespace esvr::report {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

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
  EXPECT_THAT(test::readText(folder_ / "out.mp4"),
              AllOf(HasSubstr("libx264"), HasSubstr("-framerate 30 "), HasSubstr("2x2")));
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
