// Plan: a separate process draws a blob from given places and on a turntable. The tests find the
// blob in the pictures, and they compare pictures of one camera that is given in two ways.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/esvr_render_fixture.h"

namespace esvr::test {
namespace {

using testing::ElementsAre;

TEST_F(EsvrRender, TheMiddleOfTheVolumeIsInTheMiddleOfThePicture) {
  for (const char* input : {"in.esvr", "in.vdb"}) {
    EXPECT_GT(picture(input).at(32, 24)[3], 200) << input;
    EXPECT_GT(picture(input, {"--orthographic"}).at(32, 24)[3], 200) << input;
  }
}

TEST_F(EsvrRender, AGivenCameraIsTaken) {
  const auto away = picture("in.esvr", {"--eye", "15,15,200", "--center", "15,15,400"});
  for (const png_byte v : away.rgba) ASSERT_EQ(v, 0);
  const auto seen =
      picture("in.esvr", {"--eye", "-90,15,15", "--center", "15,15,15", "--up", "0,0,1"});
  EXPECT_GT(seen.at(32, 24)[3], 0);
}

TEST_F(EsvrRender, ACameraFileIsReplacedByOptions) {
  writeText(folder_ / "cam.json", R"({"eye": [-90, 15, 15], "center": [15, 15, 15],
                                      "up": [0, 0, 1], "fov": 25})");
  const auto file = picture("in.esvr", {"--camera", folder_ / "cam.json"});
  const std::vector<std::string> same{"--eye", "-90,15,15", "--center", "15,15,15",
                                      "--up",  "0,0,1",     "--fov",    "25"};
  EXPECT_EQ(file.rgba, picture("in.esvr", same).rgba);
  EXPECT_NE(picture("in.esvr", {"--camera", folder_ / "cam.json", "--fov", "50"}).rgba, file.rgba);
  writeText(folder_ / "flat.json", R"({"height": 60})");
  EXPECT_EQ(picture("in.esvr", {"--camera", folder_ / "flat.json"}).rgba,
            picture("in.esvr", {"--orthographic", "--height", "60"}).rgba);
}

TEST_F(EsvrRender, ATurntableWritesAPictureForEveryAngle) {
  ASSERT_EQ(draw("in.esvr", "turn.png", {"--turntable", "3"}).exitCode, 0);
  EXPECT_THAT(folder_.names(),
              ElementsAre("in.esvr", "in.vdb", "turn.0000.png", "turn.0001.png", "turn.0002.png"));
  const auto first = readPng(folder_ / "turn.0000.png");
  ASSERT_EQ(draw("in.esvr", "once.png", {"--turntable", "1"}).exitCode, 0);
  EXPECT_EQ(first.rgba, readPng(folder_ / "once.0000.png").rgba) << "the same distance";
  EXPECT_NE(first.rgba, readPng(folder_ / "turn.0001.png").rgba);
}

TEST_F(EsvrRender, SomeFramesOfATurntableAreThoseOfTheWhole) {
  ASSERT_EQ(draw("in.esvr", "all.png", {"--turntable", "3"}).exitCode, 0);
  ASSERT_EQ(draw("in.esvr", "part.png", {"--turntable", "3", "--frames", "1-1"}).exitCode, 0);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "part.0000.png"));
  EXPECT_EQ(readPng(folder_ / "part.0001.png").rgba, readPng(folder_ / "all.0001.png").rgba);
}

}  // namespace
}  // namespace esvr::test
