// Plan: a sequence whose frames have grids that are not fitted is converted and converted back.
// Each frame must have all of its grids, in order and with the bytes of the source; the summary,
// the report and the warnings must tell what became of them, each thing once.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "cli/converters.h"
#include "cli/folder_test.h"
#include "cli/grids_in_file.h"
#include "cli/vdb_inputs.h"
#include "esvr/container.h"

namespace esvr {
namespace {

using Json = nlohmann::json;
using test::bytesIn;
using test::namesIn;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

std::size_t timesIn(const std::string& text, const std::string& words) {
  std::size_t count = 0;
  for (auto at = text.find(words); at != std::string::npos; at = text.find(words, at + 1)) ++count;
  return count;
}

/// Three frames with the grids bool, int32, vec3s, points and density.
class CarriedSequence : public test::FolderTest {
 protected:
  void SetUp() override {
    for (int frame = 1; frame <= 3; ++frame)
      test::writeMixedInput(in(frame), {{.voxels = test::softBall({frame, 0, 0})}});
  }
  [[nodiscard]] std::string in(int frame) const {
    return at("in." + std::to_string(frame) + ".vdb");
  }
  [[nodiscard]] std::string out(int frame) const {
    return at("out." + std::to_string(frame) + ".esvr");
  }
  [[nodiscard]] std::string back(int frame) const {
    return at("back." + std::to_string(frame) + ".vdb");
  }
  [[nodiscard]] test::ProgramRun convert(const std::vector<std::string>& more = {}) const {
    return test::quickFit(at("in.@.vdb"), at("out.@.esvr"), more);
  }
  [[nodiscard]] test::ProgramRun convertBack(const std::string& output,
                                             std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {at("out.@.esvr"), at(output), "--threads", "3"});
    return test::esvr2vdb(more);
  }
};

TEST_F(CarriedSequence, GivesAllGridsOfEachFrameBackInOrder) {
  ASSERT_EQ(convert({"--threads", "3"}).exitCode, 0);
  const auto run = convertBack("back.@.vdb");
  ASSERT_EQ(run.exitCode, 0) << run.err;
  for (int frame = 1; frame <= 3; ++frame) {
    EXPECT_EQ(namesIn(back(frame)), namesIn(in(frame)));
    EXPECT_EQ(bytesIn(back(frame), {0, 1, 2, 3}), bytesIn(in(frame), {0, 1, 2, 3}));
    ASSERT_EQ(test::quickFit(in(frame), at("one.esvr"), {"-f"}).exitCode, 0);
    EXPECT_EQ(test::readText(out(frame)), test::readText(at("one.esvr"))) << "that of the file";
  }
}

TEST_F(CarriedSequence, KeepsAndLeavesOutTheNamedGridsOfEachFrame) {
  const auto run = convert({"--keep", "density", "--skip", "bool", "--skip", "points"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.out,
              AllOf(HasSubstr("bool: left out in 3 frames, because --skip names it"),
                    HasSubstr("density: carried unchanged in 3 frames, because --keep names it"),
                    HasSubstr("int32: carried unchanged in 3 frames, because its values")));
  ASSERT_EQ(convertBack("back.@.vdb").exitCode, 0);
  for (int frame = 1; frame <= 3; ++frame) {
    EXPECT_THAT(namesIn(back(frame)), ElementsAre("int32", "vec3s", "density"));
    EXPECT_EQ(bytesIn(back(frame)), bytesIn(in(frame), {1, 2, 4}));
  }
}

TEST_F(CarriedSequence, WarnsOnceWhereNoFrameHasAFittedGrid) {
  const auto run = convert({"--keep", "density"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_EQ(timesIn(run.err, "warning"), 1u) << run.err;
  EXPECT_THAT(run.err, HasSubstr("warning: frames 1-3: no grid is fitted"));
  EXPECT_THAT(run.out, HasSubstr("bytes, 1 : ")) << "carried grids count";
  EXPECT_EQ(convert({"--keep", "density", "--quiet", "-f"}).err, "");
}

TEST_F(CarriedSequence, HasCarriedGridsInTheReportOfEachFrame) {
  const auto run = convert({"--report", "-", "--skip", "bool"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const Json report = Json::parse(run.out);
  EXPECT_EQ(report["asked"]["skip"], Json::array({"bool"}));
  for (int frame = 1; frame <= 3; ++frame) {
    const Json& entry = report["frames"][std::size_t(frame - 1)];
    ASSERT_EQ(entry["carried"].size(), 3u);
    EXPECT_EQ(entry["carried"][1]["name"], "vec3s");
    EXPECT_EQ(entry["carried"][1]["source_bytes"], inspectVdb(in(frame)).grids[2].storedBytes);
    EXPECT_EQ(entry["skipped"][0]["name"], "bool");
    EXPECT_EQ(entry["output"]["bytes"], sizeOf("out." + std::to_string(frame) + ".esvr"));
  }
}

TEST_F(CarriedSequence, FailsInFramesWithoutANamedGridOnly) {
  test::writeInput(in(2), {{.voxels = test::softBall({})}});
  const auto run = convert({"--keep", "vec3s"});
  EXPECT_EQ(run.exitCode, 3);
  EXPECT_THAT(run.err, AllOf(HasSubstr("frame 2: "), HasSubstr("no grid \"vec3s\""),
                             HasSubstr("1 of 3 frames failed: 2")));
  EXPECT_EQ(readEsvr(out(3)).carried.size(), 4u);
}

TEST_F(CarriedSequence, WarnsOnceOfGridsThatTheOutputCannotHold) {
  ASSERT_EQ(convert().exitCode, 0);
  const auto nano = convertBack("back.@.nvdb");
  EXPECT_EQ(nano.exitCode, 0) << nano.err;
  EXPECT_EQ(timesIn(nano.err, "grid \"vec3s\" is left out"), 1u) << nano.err;
  EXPECT_THAT(nano.err, AllOf(HasSubstr("warning: frames 1-3: grid \"vec3s\" is left out"),
                              HasSubstr("frames 1-3: a NanoVDB file holds no metadata"),
                              Not(HasSubstr("back.1.nvdb"))));
  const auto named = convertBack("no.@.nvdb", {"-g", "vec3s"});
  EXPECT_EQ(named.exitCode, 2);
  EXPECT_THAT(named.err, HasSubstr("no.1.nvdb: grid \"vec3s\" cannot be written"));
}

TEST_F(CarriedSequence, OfLargeCarriedGridsIsConvertedOneByOneWhereMemoryIsShort) {
  const auto within = [&](std::uint64_t bytes, const char* threads) {
    return convert({"--max-memory", std::to_string(bytes), "--threads", threads, "--keep",
                    "density", "--force"})
        .exitCode;
  };
  std::uint64_t enough = 1024;
  while (within(enough, "1") == 5) enough *= 2;
  EXPECT_EQ(within(enough, "3"), 0) << "a third of it is too little for a frame";
}

}  // namespace
}  // namespace esvr
