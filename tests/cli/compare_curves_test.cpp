// Plan: `esvr-compare curves` is run as a separate process. The tests check the points in both data
// formats, the pictures that are written, the sizes that the program chooses, and what it refuses.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>

#include "cli/compare_fixture.h"
#include "cli/converters.h"
#include "cli/csv_fields.h"
#include "cli/refusal.h"
#include "cli/vdb_inputs.h"

namespace esvr {
namespace {

using nlohmann::json;
using test::Refusal;
using testing::HasSubstr;
using testing::StartsWith;

test::ProgramRun curves(const std::vector<std::string>& arguments) {
  return test::compare("curves", arguments);
}

class CompareCurves : public test::FittedBall {
 protected:
  [[nodiscard]] json points() const { return json::parse(test::readText(at("c.json")))["points"]; }
};

std::set<std::string> seriesOf(const json& points) {
  std::set<std::string> names;
  for (const auto& point : points) names.insert(point["series"]);
  return names;
}

/// A file holds no times, so only a fit that the command makes has a curve over seconds.
TEST_F(CompareCurves, hasTheCurveOfAFitAndTheFilesOfBoth) {
  const auto run = curves({at("ref.vdb"), at("fit.esvr"), "--fit", "3KB", "--device", "cpu",
                           "--no-baselines", "-o", at("c")});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  int ofFit = 0, ofFile = 0;
  double last = 0.0;
  for (const auto& point : points()) {
    EXPECT_EQ(point["series"], "ESVR");
    if (point["kind"] == "file") ++ofFile;
    if (point["kind"] != "fit") continue;
    ++ofFit;
    EXPECT_GE(point["seconds"].get<double>(), last) << "time goes on";
    last = point["seconds"];
  }
  EXPECT_GT(ofFit, 1);
  EXPECT_EQ(ofFile, 2);
  EXPECT_THAT(test::readText(at("c.csv")), StartsWith("kind,series,name,bytes,seconds,"));
  EXPECT_THAT(folder_.names(),
              testing::ElementsAre("c.csv", "c.html", "c.json", "fit.esvr", "ref.vdb"));
}

TEST_F(CompareCurves, hasEveryPointOnThePage) {
  ASSERT_EQ(
      curves({at("ref.vdb"), "--fit", "3KB", "--no-baselines", "--device", "cpu", "-o", at("c")})
          .exitCode,
      0);
  const std::string page = test::readText(at("c.html"));
  EXPECT_THAT(page, testing::AllOf(HasSubstr("<h1>At "), HasSubstr("Error over run time"),
                                   HasSubstr("RMS error over the box, % of the peak")));
  const auto lines = test::csvFields(test::readText(at("c.csv")));
  ASSERT_GT(lines.size(), 4u);
  for (std::size_t line = 1; line < lines.size(); ++line)
    for (const std::size_t c : {3u, 4u, 5u, 6u, 7u})  // bytes to max_error
      EXPECT_TRUE(page.find("data-value=\"" + lines[line][c] + "\"") < page.size()) << line;
}

/// The values of the ball reach up to 1; a peak of 100 adds 40 dB to every figure.
TEST_F(CompareCurves, hasOnePeakForFitsAndFiles) {
  const auto run = curves({at("ref.vdb"), "--fit", "3KB", "--peak", "100", "--device", "cpu",
                           "--no-baselines", "-o", at("c")});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const json all = points();
  ASSERT_GT(all.size(), 2u);
  const json &last = all[all.size() - 2], &file = all.back();
  ASSERT_EQ(last["kind"], "fit");
  ASSERT_EQ(file["kind"], "file");
  // Quantisation may cost some dB, but not half of those of the peak.
  for (const char* key : {"psnr_box", "psnr_active"})
    EXPECT_NEAR(last[key].get<double>(), file[key].get<double>(), 20.0) << key;
}

TEST_F(CompareCurves, showsOnlyThePlotsThatHaveCurves) {
  ASSERT_EQ(curves({at("ref.vdb"), at("fit.esvr"), "--no-baselines", "-o", at("c")}).exitCode, 0);
  const std::string page = test::readText(at("c.html"));
  EXPECT_THAT(page, testing::AllOf(HasSubstr("Error over bytes"), HasSubstr("class=\"row ours\""),
                                   testing::Not(HasSubstr("Error over run time"))));
  EXPECT_THAT(folder_.names(),
              testing::ElementsAre("c.csv", "c.html", "c.json", "fit.esvr", "ref.vdb"));
}

TEST_F(CompareCurves, refusesWhatTakesMoreMemoryThanAllowed) {
  const auto run = curves(
      {at("ref.vdb"), at("fit.esvr"), "--no-baselines", "--max-memory", "1KB", "-o", at("c")});
  EXPECT_EQ(run.exitCode, 5) << run.err;
}

TEST_F(CompareCurves, SlowHasBaselinesAtEachSizeAndFramesASecond) {
  const auto run = curves({at("ref.vdb"), "--fit", "3KB", "--fit", "5KB", "--device", "cpu",
                           "--fps", "24", "-o", at("c")});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const auto all = points();
  EXPECT_THAT(seriesOf(all), testing::IsSupersetOf({"ESVR", "NanoVDB FpN Zip"}));
  for (const auto& point : all)
    if (point["kind"] == "file") {
      EXPECT_GT(point["fps"].get<double>(), 0.0);
      EXPECT_LE(point["bytes"].get<double>(), 5000);
    }
  EXPECT_THAT(test::readText(at("c.html")), HasSubstr("<h3>Pictures per second over bytes</h3>"));
}

TEST_F(CompareCurves, SlowChoosesSixSizesAndTellsThoseThatAreTooSmall) {
  const auto run = curves({at("ref.vdb"), "--no-baselines", "--device", "cpu", "-o", at("c")});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  // The ball's VDB is so small that a hundredth of its size has no room for a grid.
  std::size_t files = 0, refused = 0;
  for (const auto& point : points()) files += point["kind"] == "file";
  for (std::size_t at = 0; (at = run.err.find("no fit of", at)) != std::string::npos; ++at)
    ++refused;
  EXPECT_GT(files, 0u);
  EXPECT_GT(refused, 0u);
  EXPECT_EQ(files + refused, 6u);
}

class RefusedCurves : public CompareCurves, public testing::WithParamInterface<Refusal> {};

TEST_P(RefusedCurves, isExplainedAndLeavesNoFile) {
  test::writeText(at("there.csv"), "precious");
  GetParam().expectOf(curves(GetParam().argumentsIn(folder_)));
  EXPECT_THAT(folder_.names(), testing::ElementsAre("fit.esvr", "ref.vdb", "there.csv"));
}

INSTANTIATE_TEST_SUITE_P(
    All, RefusedCurves,
    testing::Values(Refusal{{}, 2, "REF.vdb"}, Refusal{{"DIR/ref.vdb"}, 2, "--output"},
                    Refusal{{"DIR/ref.vdb", "-o", "DIR/there"}, 1, "there.csv"},
                    Refusal{{"DIR/ref.vdb", "-o", "DIR/c", "--fps", "0"}, 2, "--fps"},
                    Refusal{{"DIR/ref.vdb", "-o", "DIR/none/c"}, 1, "none"},
                    Refusal{{"DIR/none.vdb", "-o", "DIR/c"}, 3, "none.vdb"},
                    Refusal{{"DIR/ref.vdb", "DIR/none.esvr", "-o", "DIR/c"}, 3, "none.esvr"}));

}  // namespace
}  // namespace esvr
