// Plan: sequences with known errors are compared as a user does. The temporal PSNR must see errors
// that change from frame to frame, and no others, and each frame must be compared with its own.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "cli/converters.h"
#include "cli/folder_test.h"
#include "cli/vdb_inputs.h"

namespace esvr {
namespace {

using Json = nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;
using Words = std::vector<std::string>;

/// Three frames of balls with the peaks 2, 3 and 4 as a.1.vdb, ...; b.#.vdb are brighter by a part.
class SequenceCheck : public test::FolderTest {
 protected:
  void SetUp() override { writeFrames("a", {0.0f, 0.0f, 0.0f}); }
  void writeFrames(const std::string& name, const std::vector<float>& brighter) const {
    for (std::size_t i = 0; i < brighter.size(); ++i) {
      auto voxels = test::softBall({}, float(i + 2));
      for (auto& voxel : voxels) voxel.value += brighter[i];
      test::writeInput(at(name + "." + std::to_string(i + 1) + ".vdb"), {{.voxels = voxels}});
    }
  }
  [[nodiscard]] test::ProgramRun check(const std::string& candidate, Words more = {}) const {
    more.insert(more.begin(), {"check", at("a.@.vdb"), at(candidate)});
    return test::runProgram(ESVR_COMPARE, more);
  }
  void store(const std::string& frames) const {
    const auto run = test::vdb2esvr(
        {at("a.@.vdb"), at("a.esvr"), "--lossless", "--device", "cpu", "--frames", frames});
    ASSERT_EQ(run.exitCode, 0) << run.err;
  }
};

TEST_F(SequenceCheck, findsNoErrorInAFileThatHasEveryBit) {
  store("1-3");
  const auto run = check("a.esvr", {"--min-psnr-temporal", "300", "--report", at("r.json")});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("temporal"), HasSubstr("frame 3: density")));
  const Json report = Json::parse(test::readText(at("r.json")));
  ASSERT_EQ(report["grids"].size(), 3u);
  EXPECT_FALSE(report["grids"][0].contains("psnr_temporal")) << "there is no frame before it";
  EXPECT_TRUE(report["grids"][2]["psnr_temporal"].is_null()) << "infinite";
  EXPECT_EQ(report["grids"][2]["frame"], 3);
  EXPECT_EQ(report["bytes"], sizeOf("a.esvr"));
}

TEST_F(SequenceCheck, doesNotCountErrorsThatAllFramesShare) {
  writeFrames("b", {0.25f, 0.25f, 0.25f});
  EXPECT_EQ(check("b.@.vdb", {"--min-psnr-temporal", "100"}).exitCode, 0);
  EXPECT_EQ(check("b.@.vdb", {"--min-psnr", "100"}).exitCode, 4);
}

TEST_F(SequenceCheck, countsErrorsThatChange) {
  writeFrames("b", {0.25f, 0.25f, 0.5f});
  const auto run = check("b.@.vdb", {"--min-psnr-temporal", "100"});
  EXPECT_EQ(run.exitCode, 4);
  EXPECT_THAT(run.err, HasSubstr("frame 3: grid \"density\": temporal"));
  EXPECT_THAT(run.err, testing::Not(HasSubstr("frame 2: grid")));
}

TEST_F(SequenceCheck, namesFramesThatOnlyOneSequenceHas) {
  store("1-2");
  const auto run = check("a.esvr");
  EXPECT_EQ(run.exitCode, 4);
  EXPECT_THAT(run.err, HasSubstr("1 of 3 frames are not in " + at("a.esvr") + ": 3"));
  EXPECT_EQ(check("a.esvr", {"--frames", "1-2"}).exitCode, 0);
}

TEST_F(SequenceCheck, refusesASingleFileBesideASequence) {
  EXPECT_EQ(check("a.1.vdb").exitCode, 2);
  const auto run = test::runProgram(
      ESVR_COMPARE, {"check", at("a.1.vdb"), at("a.1.vdb"), "--min-psnr-temporal", "40"});
  EXPECT_EQ(run.exitCode, 2);
  EXPECT_THAT(run.err, HasSubstr("--min-psnr-temporal need sequences"));
}

}  // namespace
}  // namespace esvr
