// Plan: a fit in chunks gives the same bytes in one run and in a run that was interrupted or killed
// and continued. A folder of another run, of damaged parts, or of a running process is refused.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>

#include "cli/converters.h"
#include "cli/folder_test.h"
#include "cli/vdb_inputs.h"
#include "esvr/part_store.h"

namespace esvr {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class Parts : public test::FolderTest {
 protected:
  void SetUp() override { test::writeInput(at("in.vdb"), {{.voxels = test::cloud(8)}}); }

  [[nodiscard]] std::vector<std::string> argumentsFor(const std::string& name,
                                                      const std::vector<std::string>& more) const {
    std::vector<std::string> all{at("in.vdb"),       at(name),     "--count",        "40",
                                 "--iterations",     "60",         "--chunk-voxels", "600",
                                 "--representation", "ellipsoids", "--device",       "cpu"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  [[nodiscard]] test::ProgramRun run(const std::string& name,
                                     const std::vector<std::string>& more = {}) const {
    return test::vdb2esvr(argumentsFor(name, more));
  }
  void expectSameBytes(const std::string& name) const {
    EXPECT_EQ(run("one.esvr").exitCode, 0);
    EXPECT_EQ(test::readText(at(name)), test::readText(at("one.esvr")));
    EXPECT_FALSE(fs::exists(at(name) + ".parts"));
  }
  /// Interrupts a run that keeps its parts.
  test::ProgramRun stopWithParts() const {
    auto stopped =
        test::runInterrupted(VDB2ESVR, argumentsFor("out.esvr", {"--resume", "--progress", "json"}),
                             "\"parts_done\":3,");
    EXPECT_EQ(stopped.exitCode, 1);
    EXPECT_FALSE(anyPart().empty());
    return stopped;
  }
  /// A result in the folder of finished parts.
  [[nodiscard]] fs::path anyPart() const {
    for (const auto& entry : fs::directory_iterator(at("out.esvr.parts")))
      if (entry.path().extension() == ".part") return entry.path();
    return {};
  }
};

TEST_F(Parts, ofAnInterruptedRunAreUsedAgain) {
  const auto stopped = stopWithParts();
  EXPECT_THAT(stopped.err, HasSubstr("the same command continues"));
  EXPECT_FALSE(fs::exists(at("out.esvr")));
  const auto resumed = run("out.esvr", {"--resume"});
  EXPECT_EQ(resumed.exitCode, 0) << resumed.err;
  expectSameBytes("out.esvr");
}

TEST_F(Parts, ofAnotherFitAreNotNamedByARunThatKeepsNone) {
  fs::create_directory(at("out.esvr.parts"));
  const auto stopped = test::runInterrupted(
      VDB2ESVR, argumentsFor("out.esvr", {"--progress", "json"}), "\"parts_done\":3,");
  EXPECT_THAT(stopped.err, AllOf(HasSubstr("interrupted"), Not(HasSubstr("out.esvr.parts"))));
}

TEST_F(Parts, areReportedAsJson) {
  std::istringstream lines(run("out.esvr", {"--progress", "json"}).err);
  int count = 0;
  double fraction = 0.0;
  for (std::string line; std::getline(lines, line); ++count) {
    const auto json = nlohmann::json::parse(line);
    EXPECT_EQ(json["grid"], "density");
    EXPECT_GE(json["fraction"], fraction);
    EXPECT_LE(json["parts_done"], json["parts"]);
    fraction = json["fraction"];
  }
  EXPECT_GT(count, 10);
  EXPECT_NEAR(fraction, 1.0, 1e-9);
}

TEST_F(Parts, thatAreDamagedAreRefused) {
  stopWithParts();
  fs::resize_file(anyPart(), 100);
  const auto resumed = run("out.esvr", {"--resume"});
  EXPECT_EQ(resumed.exitCode, 3);
  EXPECT_THAT(resumed.err, HasSubstr("is damaged; remove it"));
}

TEST_F(Parts, ofAnotherRunAreRefusedWithBothNames) {
  stopWithParts();
  const auto otherOption = run("out.esvr", {"--resume", "--seed", "5"});
  EXPECT_EQ(otherOption.exitCode, 3);
  EXPECT_THAT(otherOption.err, HasSubstr("its seed is 1, not 5"));
  fs::copy_file(at("in.vdb"), at("other.vdb"));
  auto arguments = argumentsFor("out.esvr", {"--resume"});
  arguments[0] = at("other.vdb");
  const auto otherInput = test::vdb2esvr(arguments);
  EXPECT_EQ(otherInput.exitCode, 3);
  EXPECT_THAT(otherInput.err, AllOf(HasSubstr("in.vdb, not "), HasSubstr("other.vdb")));
}

TEST_F(Parts, areNotUsedByTwoRunsAtATime) {
  const PartStore store(at("out.esvr.parts"), {}, PartStore::Access::kAlone);
  const auto second = run("out.esvr", {"--resume"});
  EXPECT_EQ(second.exitCode, 1);
  EXPECT_THAT(second.err, HasSubstr("another process uses"));
}

TEST_F(Parts, cannotBeKeptOnAFullDisk) {
  std::string command = VDB2ESVR;
  for (const auto& argument : argumentsFor("out.esvr", {"--resume"})) command += ' ' + argument;
  const auto full = test::runOnFullDisk(command);
  EXPECT_EQ(full.exitCode, 1);
  EXPECT_THAT(full.err, AllOf(HasSubstr("out.esvr.parts/"), HasSubstr("File too large")));
  EXPECT_EQ(run("out.esvr", {"--resume"}).exitCode, 0);
  expectSameBytes("out.esvr");
}

TEST_F(Parts, keepFilesOfOthersInTheirFolder) {
  fs::create_directory(at("out.esvr.parts"));
  test::writeText(at("out.esvr.parts/notes.txt"), "mine");
  EXPECT_EQ(run("out.esvr", {"--resume"}).exitCode, 0);
  EXPECT_EQ(test::readText(at("out.esvr.parts/notes.txt")), "mine");
  EXPECT_EQ(std::distance(fs::directory_iterator(at("out.esvr.parts")), {}), 1);
}

TEST_F(Parts, followNoLinkInTheirFolder) {
  test::writeText(at("precious"), "mine");
  for (const char* name : {"lock", "origin"}) {
    fs::remove_all(at("out.esvr.parts"));
    fs::create_directory(at("out.esvr.parts"));
    fs::create_symlink(at("precious"), at("out.esvr.parts/") + name);
    const auto refused = run("out.esvr", {"--resume"});
    EXPECT_EQ(refused.exitCode, 1);
    EXPECT_THAT(refused.err, HasSubstr("not a regular file"));
    EXPECT_EQ(test::readText(at("precious")), "mine");
  }
}

}  // namespace
}  // namespace esvr
