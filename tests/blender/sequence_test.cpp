// Plan: frames with balls at different places are converted as a sequence, there and back. Blender
// finds all frames of the files that esvr2vdb wrote, in their order, and shows the bounds of the
// original frames.

#include <gmock/gmock.h>

#include "blender/blender.h"
#include "cli/vdb_inputs.h"

namespace esvr {
namespace {

using BlenderSequence = test::Blender;

TEST_F(BlenderSequence, SlowIsFoundWithAllFrames) {
  constexpr int kBrick = 8;
  for (const int frame : {7, 8, 9})
    test::writeInput(at("in.000" + std::to_string(frame) + ".vdb"),
                     {{.voxels = test::softBall({frame * kBrick, 0, 0})}});
  const auto there = test::vdb2esvr({at("in.####.vdb"), at("in.####.esvr")});
  ASSERT_EQ(there.exitCode, 0) << there.err;
  const auto back = test::esvr2vdb({at("in.####.esvr"), at("smoke.####.vdb")});
  ASSERT_EQ(back.exitCode, 0) << back.err;

  const auto both = facts({at("in.####.vdb"), at("smoke.####.vdb")});
  const auto &source = both[0]["sequence"], &shown = both[1]["sequence"];
  EXPECT_EQ(shown["is_sequence"], true);
  EXPECT_EQ(shown["frame_duration"], 3);
  EXPECT_EQ(shown["frame_start"], source["frame_start"]);
  EXPECT_EQ(shown["frame_offset"], source["frame_offset"]);
  ASSERT_EQ(shown["frames"].size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(shown["frames"][i]["file"], "smoke.000" + std::to_string(7 + i) + ".vdb");
    EXPECT_EQ(shown["frames"][i]["error"], "");
    EXPECT_EQ(shown["frames"][i]["bound_box"], source["frames"][i]["bound_box"]);
  }
  EXPECT_NE(shown["frames"][0]["bound_box"], shown["frames"][2]["bound_box"]);
}

}  // namespace
}  // namespace esvr
