// Plan: esvr-render is run with options that are wrong, with input that it cannot draw, and with
// pictures that are too large. The tests check the exit code and the message.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>

#include "cli/esvr_render_fixture.h"

namespace esvr::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;

TEST_F(EsvrRender, OptionsThatMakeNoSenseAreRefused) {
  expectRefused({"--resolution", "64"}, 2, "--resolution");
  expectRefused({"--resolution", "0x4"}, 2, "--resolution");
  expectRefused({"--resolution", "40000x4"}, 2, "32767");
  expectRefused({"--step", "0"}, 2, "--step");
  expectRefused({"--step", "-1"}, 2, "--step");
  expectRefused({"--step", "nan"}, 2, "--step");
  expectRefused({"--opacity-length", "0"}, 2, "--opacity-length");
  expectRefused({"--colors", "jet"}, 2, "viridis");
  expectRefused({"--opacity", "cubic"}, 2, "tent");
  expectRefused({"--range", "3,1"}, 2, "LO <= HI");
  expectRefused({"--range", "1"}, 2, "--range");
  expectRefused({"--eye", "1,2"}, 2, "--eye");
  expectRefused({"--eye", "1,2,nan"}, 2, "--eye");
  expectRefused({"--eye", "0,9,0", "--center", "0,0,0", "--up", "0,1,0"}, 2, "up");
  expectRefused({"--fov", "180"}, 2, "field of view");
  expectRefused({"--fov", "20", "--orthographic"}, 2, "--fov");
  expectRefused({"--height", "20"}, 2, "--orthographic");
  expectRefused({"--background", "1,2,3"}, 2, "--background");
  expectRefused({"--turntable", "0"}, 2, "--turntable");
  expectRefused({"--preset", "x"}, 2, "--tf");
  expectRefused({"--bits", "12"}, 2, "--bits");
  expectRefused({"--mode", "minimum"}, 2, "maximum");
  expectRefused({"--clip", "1,0,0,0,1,1"}, 2, "clip");
  expectRefused({"--clip", "0,0,0,1,1,1", "--slice", "x=1"}, 2, "--slice");
  expectRefused({"--slice", "w=1"}, 2, "--slice");
  expectRefused({"--slice", "z="}, 2, "--slice");
  expectRefused({"--frames", "0-1"}, 2, "--turntable");
  expectRefused({"--turntable", "3", "--frames", "2-3"}, 2, "--frames");
  expectRefused({"--depth", "z.png"}, 2, ".exr");
  expectRefused({"--depth-parts", "17"}, 2, "--depth-parts");
  expectRefused({"--values", "fp32"}, 2, "fp16");
  expectRefused({"--sheet", "s.png"}, 2, "--ref");
  expectRefused({"--min-transmittance", "1"}, 2, "transmittance");
  expectRefused({"--device", "gpu"}, 2, "gpu");
  expectRefused({"--bench"}, 2, "--bench");
  expectRefused({"--report", "r.json"}, 2, "--ref");
}

TEST_F(EsvrRender, InputThatCannotBeDrawnIsRefused) {
  expectRefused({"--grid", "none"}, 3, "density");
  expectRefused({"--tf", folder_ / "missing.json"}, 3, "missing.json");
  expectRefused({"--ref", folder_ / "missing.vdb"}, 3, "missing.vdb");
  expectRefused({"--camera", folder_ / "missing.json"}, 3, "missing.json");
  writeText(folder_ / "cam.json", R"({"eye": [1, 2]})");
  expectRefused({"--camera", folder_ / "cam.json"}, 3, "three numbers");
  writeText(folder_ / "cam.json", R"({"eyes": [1, 2, 3]})");
  expectRefused({"--camera", folder_ / "cam.json"}, 3, "eyes");
  EXPECT_EQ(draw("missing.esvr", "refused.png").exitCode, 3);
  EXPECT_EQ(draw("missing.vdb", "refused.png").exitCode, 3);
  writeText(folder_ / "bad.esvr", "nothing of the kind");
  EXPECT_EQ(draw("bad.esvr", "refused.png").exitCode, 3);
  EXPECT_EQ(draw("in.esvr", "refused.jpg").exitCode, 2);
}

TEST_F(EsvrRender, PicturesBeyondTheMemoryAllowedAreRefused) {
  const auto large =
      draw("in.esvr", "large.png", {"--resolution", "30000x30000", "--max-memory", "1GB"});
  EXPECT_EQ(large.exitCode, 5);
  EXPECT_THAT(large.err, AllOf(HasSubstr("30000 x 30000"), HasSubstr("43.2 GB")));
  EXPECT_EQ(draw("in.esvr", "large.png", {"--resolution", "100000x100000"}).exitCode, 2);
}

TEST_F(EsvrRender, TwoOutputsAreNeverOneFile) {
  const std::vector<std::string> reference{"--ref", folder_ / "in.vdb"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.end(), reference.begin(), reference.end());
    return more;
  };
  expectRefused(with({"--sheet", folder_ / "refused.png"}), 2, "are one file");
  expectRefused(with({"--sheet", folder_ / "refused.error.png"}), 2, "are one file");
  std::filesystem::create_symlink(folder_ / "in.vdb", folder_ / "link.png");
  expectRefused(with({"--sheet", folder_ / "link.png", "--force"}), 2, "are one file");
}

TEST_F(EsvrRender, APipeWithoutAWriterIsRefusedSlow) {
  ASSERT_EQ(::mkfifo((folder_ / "pipe").c_str(), 0600), 0);
  expectRefused({"--camera", folder_ / "pipe"}, 3, "no program writes to it");
  expectRefused({"--tf", folder_ / "pipe"}, 3, "no program writes to it");
}

TEST_F(EsvrRender, ACameraMayComeThroughAPipe) {
  const auto run = runProgram(
      "/bin/bash", {"-c", std::string(ESVR_RENDER) + " - " + (folder_ / "out.png").string() +
                              " --resolution 16x16 --camera <(echo '{\"eye\": [1, 2, 90]}') < " +
                              (folder_ / "in.esvr").string()});
  EXPECT_EQ(run.exitCode, 0) << run.err;
}

}  // namespace
}  // namespace esvr::test
