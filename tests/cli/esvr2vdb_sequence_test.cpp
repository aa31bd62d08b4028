// Plan: sequences of .esvr files are converted back. The frames must have the voxels of single
// conversions. Frames that are missing or damaged are treated as the options say.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>

#include "cli/converters.h"
#include "cli/folder_test.h"
#include "cli/vdb_inputs.h"
#include "esvr/vdb_io.h"

namespace esvr {
namespace {

using test::esvr2vdb;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using Words = std::vector<std::string>;

/// Three frames as in.1.vdb and in.1.esvr, ...
class SequenceBack : public test::FolderTest {
 protected:
  void SetUp() override {
    for (const std::string frame : {"1", "2", "3"})
      test::writeInput(at("in." + frame + ".vdb"),
                       {{.voxels = test::softBall({}, std::stof(frame))}});
    ASSERT_EQ(test::quickFit(at("in.@.vdb"), at("in.@.esvr")).exitCode, 0);
  }
  [[nodiscard]] test::ProgramRun back(Words more = {},
                                      const std::string& output = "out.%02d.vdb") const {
    more.insert(more.begin(), {at("in.@.esvr"), at(output)});
    return esvr2vdb(more);
  }
  [[nodiscard]] Words outputs() const {
    Words names = folder_.names();
    std::erase_if(names, [](const std::string& name) { return name.starts_with("in."); });
    return names;
  }
  [[nodiscard]] SparseVolume voxelsOf(const std::string& name) const {
    return readGrid(at(name), "density").volume;
  }
};

TEST_F(SequenceBack, hasTheVoxelsOfSingleFiles) {
  const auto run = back({"--frames", "1-3x2"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(outputs(), ElementsAre("out.01.vdb", "out.03.vdb"));
  ASSERT_EQ(esvr2vdb({at("in.3.esvr"), at("one.vdb")}).exitCode, 0);
  EXPECT_EQ(voxelsOf("out.03.vdb").values, voxelsOf("one.vdb").values);
  EXPECT_NE(voxelsOf("out.01.vdb").values, voxelsOf("one.vdb").values);
}

TEST_F(SequenceBack, isComparedWithASequence) {
  const auto run = back({"--reference", at("in.@.vdb"), "--threads", "3"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const std::size_t one = run.out.find("frame 1:"), three = run.out.find("frame 3:");
  EXPECT_LT(one, three) << "in their order";
  EXPECT_NE(three, std::string::npos);
  EXPECT_EQ(back({"--reference", at("in.1.vdb"), "-f"}).exitCode, 2) << "no pattern";
}

TEST_F(SequenceBack, holdsOrSkipsMissingFrames) {
  EXPECT_EQ(back({"--frames", "2-4"}).exitCode, 3);
  ASSERT_EQ(back({"--frames", "2-4", "--missing", "skip"}).exitCode, 0);
  EXPECT_THAT(outputs(), ElementsAre("out.02.vdb", "out.03.vdb"));
  ASSERT_EQ(back({"--frames", "2-4", "--missing", "hold"}, "held.##.vdb").exitCode, 0);
  EXPECT_EQ(voxelsOf("held.04.vdb").values, voxelsOf("out.03.vdb").values);
}

TEST_F(SequenceBack, namesDamagedFramesAndStopsWhereAsked) {
  test::writeText(at("in.2.esvr"), "no file of ellipsoids");
  const auto stopped = back({"--on-error", "stop", "--threads", "1"}, "stop.##.vdb");
  EXPECT_EQ(stopped.exitCode, 3);
  EXPECT_THAT(outputs(), ElementsAre("stop.01.vdb"));
  const auto run = back();
  EXPECT_EQ(run.exitCode, 3);
  EXPECT_THAT(run.err, AllOf(HasSubstr("frame 2: "), HasSubstr("1 of 3 frames failed: 2")));
  EXPECT_THAT(outputs(), ElementsAre("out.01.vdb", "out.03.vdb", "stop.01.vdb"));
}

TEST_F(SequenceBack, isDecodedOneByOneWhereMemoryIsShort) {
  const auto within = [&](std::uint64_t bytes, const char* threads) {
    return back({"--max-memory", std::to_string(bytes), "--threads", threads, "--force"}).exitCode;
  };
  std::uint64_t enough = 1024;
  while (within(enough, "1") == 5) enough *= 2;
  EXPECT_EQ(within(enough, "3"), 0) << "a third of it is too little for a frame";
  EXPECT_EQ(within(enough / 2, "3"), 5);
}

TEST_F(SequenceBack, refusesWhatASequenceCannotHave) {
  EXPECT_EQ(back({}, "out.vdb").exitCode, 2);
  EXPECT_EQ(esvr2vdb({"--list", at("in.1.esvr"), "--frames", "1"}).exitCode, 2);
  EXPECT_EQ(esvr2vdb({at("in.1.esvr"), at("out.vdb"), "--frames", "1"}).exitCode, 2);
  test::writeText(at("out.02.vdb"), "mine");
  EXPECT_THAT(back().err, HasSubstr("it exists already"));
  EXPECT_EQ(back({"--force"}).exitCode, 0);
}

}  // namespace
}  // namespace esvr
