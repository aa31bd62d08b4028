// Plan: these tests cover the options of esvr2vdb whose effect no other test shows. Each test
// compares the output with and without an option.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "cli/converters.h"
#include "cli/folder_test.h"
#include "cli/vdb_inputs.h"
#include "esvr/vdb_io.h"

namespace esvr {
namespace {

class Esvr2VdbOption : public test::FolderTest {
 protected:
  /// A cube of 16^3 equal voxels, stored losslessly, which a tree can hold as tiles.
  void SetUp() override {
    std::vector<test::InputVoxel> cube;
    for (int v = 0; v < 4096; ++v) cube.push_back({{v / 256, v / 16 % 16, v % 16}, 1.0f});
    test::writeInput(at("in.vdb"), {{.voxels = cube}});
    ASSERT_EQ(test::vdb2esvr({at("in.vdb"), at("in.esvr"), "--lossless"}).exitCode, 0);
  }
  [[nodiscard]] test::ProgramRun decode(const std::string& name,
                                        std::vector<std::string> more) const {
    more.insert(more.begin(), {at("in.esvr"), at(name)});
    auto run = test::esvr2vdb(more);
    EXPECT_EQ(run.exitCode, 0) << run.err;
    return run;
  }
};

TEST_F(Esvr2VdbOption, noTilesWritesLeaves) {
  constexpr int kSide = 72;  // small grids keep their leaves for Blender
  std::vector<test::InputVoxel> cube;
  for (int v = 0; v < kSide * kSide * kSide; ++v)
    cube.push_back({{v / (kSide * kSide), v / kSide % kSide, v % kSide}, 1.0f});
  test::writeInput(at("in.vdb"), {{.voxels = cube}});
  ASSERT_EQ(test::vdb2esvr({at("in.vdb"), at("in.esvr"), "--lossless", "--force"}).exitCode, 0);
  (void)decode("tiles.vdb", {});
  (void)decode("leaves.vdb", {"--no-tiles"});
  EXPECT_GT(sizeOf("leaves.vdb"), sizeOf("tiles.vdb"));
  EXPECT_EQ(readGrid(at("leaves.vdb"), "density").volume.values,
            readGrid(at("tiles.vdb"), "density").volume.values);
}

TEST_F(Esvr2VdbOption, boxIsWherePsnrIsTaken) {
  ASSERT_EQ(test::quickFit(at("in.vdb"), at("in.esvr"), {"--force"}).exitCode, 0);
  const std::vector<std::string> compared{"--reference", at("in.vdb")};
  const auto usual = decode("a.vdb", compared);
  const auto larger = decode("b.vdb", {"--reference", at("in.vdb"), "--box", "0,0,0,99,99,99"});
  EXPECT_NE(usual.out, larger.out);
}

}  // namespace
}  // namespace esvr
