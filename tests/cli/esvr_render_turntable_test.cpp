// Plan: a separate process draws turntables into files, folders and videos. A script stands for
// ffmpeg and keeps the pixels or the arguments that it gets.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/esvr_render_fixture.h"
#include "support/search_path.h"

namespace esvr::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class EsvrRenderTurn : public EsvrRender {
 protected:
  void useFfmpeg(const std::string& script) { path_.add("ffmpeg", kOutputOfFfmpeg + script); }

  SearchPath path_;
};

TEST_F(EsvrRenderTurn, AVideoHasThePicturesOfTheFiles) {
  useFfmpeg("cat > \"$out\"");
  const std::vector<std::string> turn{"--turntable", "3", "--background", "0,0,0"};
  const auto run = draw("in.esvr", "turn.mp4", turn);
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("3 pictures, 0.1 s of video"));
  std::string expected;
  ASSERT_EQ(draw("in.esvr", "turn.png", turn).exitCode, 0);
  for (const char* file : {"turn.0000.png", "turn.0001.png", "turn.0002.png"}) {
    const Pixels picture = readPng(folder_ / file);
    for (std::size_t i = 0; i < picture.rgba.size(); ++i)
      if (i % 4 != 3) expected.push_back(char(picture.rgba[i]));
  }
  EXPECT_TRUE(readText(folder_ / "turn.mp4") == expected);
}

TEST_F(EsvrRenderTurn, FfmpegGetsTheRateAndTheCommandLine) {
  useFfmpeg("cat > /dev/null; echo \"$@\" > \"$out\"");
  ASSERT_EQ(draw("in.esvr", "turn.webm", {"--turntable", "2", "--fps", "12.5"}).exitCode, 0);
  const std::string arguments = readText(folder_ / "turn.webm");
  EXPECT_THAT(arguments, HasSubstr("-framerate 12.5 "));
  EXPECT_THAT(arguments, HasSubstr("64x48"));
  EXPECT_THAT(arguments, HasSubstr("turn.webm --turntable 2 --fps 12.5"));
}

TEST_F(EsvrRenderTurn, NothingIsLeftOfAVideoThatFails) {
  useFfmpeg("cat > /dev/null; echo Unknown encoder >&2; exit 1");
  const auto run = draw("in.esvr", "turn.mp4", {"--turntable", "2"});
  EXPECT_EQ(run.exitCode, 1);
  EXPECT_THAT(run.err, HasSubstr("turn.mp4: ffmpeg: Unknown encoder"));
  EXPECT_THAT(folder_.names(), ElementsAre("in.esvr", "in.vdb"));
}

TEST_F(EsvrRenderTurn, AnInterruptedVideoLeavesNothing) {
  useFfmpeg("exec sleep 60");
  const auto run = runInterrupted(ESVR_RENDER, {folder_ / "in.esvr", folder_ / "turn.mp4",
                                                "--turntable", "9999", "--resolution", "64x48"});
  EXPECT_EQ(run.exitCode, 1);
  EXPECT_THAT(run.err, HasSubstr("interrupted; nothing was written"));
  EXPECT_THAT(folder_.names(), ElementsAre("in.esvr", "in.vdb"));
}

TEST_F(EsvrRenderTurn, AVideoWithoutFfmpegIsRefused) {
  path_.hideOthers();
  const auto run = draw("in.esvr", "turn.mp4", {"--turntable", "2"});
  EXPECT_EQ(run.exitCode, 2);
  EXPECT_THAT(run.err, HasSubstr("install"));
}

TEST_F(EsvrRenderTurn, WhatAVideoCannotBeIsRefused) {
  useFfmpeg("cat > \"$out\"");
  const auto refused = [&](std::vector<std::string> more, const std::string& why) {
    const auto run = draw("in.esvr", "turn.mp4", std::move(more));
    EXPECT_EQ(run.exitCode, 2);
    EXPECT_THAT(run.err, HasSubstr(why));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "turn.mp4"));
  };
  refused({}, "--turntable");
  refused({"--turntable", "2", "--resolution", "63x48"}, "even");
  refused({"--turntable", "2", "--bits", "16"}, "--bits");
  refused({"--turntable", "2", "--ref", folder_ / "in.vdb"}, "--ref");
  refused({"--turntable", "2", "--fps", "0"}, "--fps");
  expectRefused({"--turntable", "2", "--fps", "30"}, 2, "--fps");
}

TEST_F(EsvrRenderTurn, APatternOrAFolderNamesThePictures) {
  const std::vector<std::string> turn{"--turntable", "2"};
  ASSERT_EQ(draw("in.esvr", "a_%02d_b.png", turn).exitCode, 0);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "a_00_b.png"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "a_01_b.png"));
  ASSERT_EQ(draw("in.esvr", "new/", turn).exitCode, 0);
  ASSERT_EQ(draw("in.esvr", "new", {"--turntable", "3", "--frames", "2-2"}).exitCode, 0);
  for (const char* file : {"frame.0000.png", "frame.0001.png", "frame.0002.png"})
    EXPECT_TRUE(std::filesystem::exists(folder_ / "new" / file)) << file;
  EXPECT_EQ(draw("in.esvr", "new").exitCode, 2) << "a single picture needs a name";
}

TEST_F(EsvrRenderTurn, DistancesAreFilesBesideAVideo) {
  useFfmpeg("cat > \"$out\"");
  ASSERT_EQ(
      draw("in.esvr", "turn.mp4", {"--turntable", "2", "--depth", folder_ / "z_%d.exr"}).exitCode,
      0);
  EXPECT_THAT(folder_.names(), ElementsAre("in.esvr", "in.vdb", "turn.mp4", "z_0.exr", "z_1.exr"));
}

}  // namespace
}  // namespace esvr::test
