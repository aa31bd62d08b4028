// Plan: grids of one file that are alike take fewer bytes together than apart, at the quality that was
// asked for, and grids with the same voxels are stored once. Each can be read back without the others.
// What is shared and when is tested in tests/encode/convert_file_test.cpp.

#include "cli/conversion.h"

namespace esvr::test {
namespace {

using testing::HasSubstr;
using testing::Not;

constexpr double kStandardPsnr = 40.0;

class SharingGrids : public Conversion {
 protected:
  void SetUp() override {
    writeInput(in(), {{.name = "density", .voxels = softBall({})},
                      {.name = "heat", .voxels = softBall({}, 40.0f)},
                      {.name = "far", .voxels = softBall({40, 0, 0}, 2.0f)}});
  }

  [[nodiscard]] ProgramRun run(const Words& options) const {
    return convert(joined({"--device", "cpu", "--representation", "voxels", "--measure", "values",
                           "--report", at("r.json")},
                          options));
  }
  Json reportOf(const Words& options = {}) {
    run_ = succeeded(run(options));
    return Json::parse(readText(at("r.json")));
  }
  ProgramRun run_;
};

TEST_F(SharingGrids, takeFewerBytesWithTheSameQuality) {
  reportOf("--share off");
  const std::uint64_t apart = sizeOf("out.esvr");
  EXPECT_EQ(inspectEsvr(out()).versionMinor, 0);
  const Json report = reportOf();
  EXPECT_LT(3 * sizeOf("out.esvr"), 2 * apart);
  EXPECT_EQ(inspectEsvr(out()).versionMinor, 4);
  EXPECT_EQ(readEsvr(out()).grids[1].reference->grid, std::size_t{0});
  for (const Json& grid : report["grids"]) EXPECT_GE(grid["metrics"]["psnr_active"], kStandardPsnr);
}

TEST_F(SharingGrids, areNamedByTheReportAndTheSummary) {
  reportOf("--share off");
  const std::uint64_t apart = sizeOf("out.esvr");
  const Json report = reportOf(), heat = report["grids"][1];
  EXPECT_EQ(report["asked"]["share"], "auto");
  EXPECT_EQ(heat["shared"]["with"], "density");
  EXPECT_LT(heat["shared"]["bytes_with"], heat["shared"]["bytes_without"]);
  // The padding of the last section is counted.
  EXPECT_GE(report["output"]["bytes_separate"], apart);
  EXPECT_LT(report["output"]["bytes_separate"], apart + 8);
  EXPECT_THAT(run_.out, Says("heat: refers to density", "bytes smaller"));
}

TEST_F(SharingGrids, areReadOneByOne) {
  reportOf();
  const std::string back = folder_ / "back.vdb", all = folder_ / "all.vdb";
  succeeded(esvr2vdb({out(), back, "-g", "heat"}));
  succeeded(esvr2vdb({out(), all}));
  EXPECT_EQ(inspectVdb(back).grids.size(), 1u);
  EXPECT_EQ(readGrid(back, "heat").volume.values, readGrid(all, "heat").volume.values);
  succeeded(esvr2vdb({"--check", out()}));
  EXPECT_THAT(esvr2vdb({"--list", out()}).out, Says("related voxels", "grid records"));
  EXPECT_THAT(esvr2vdb({"--list", "-v", out()}).out, HasSubstr("voxels refer to density"));
}

TEST_F(SharingGrids, thatDoNotExistAreRefused) {
  for (const Words& options : {Words{"--psnr", "smoke=40"}, {"--max-error", "smoke=1%"}})
    EXPECT_THAT(this->run(options), Fails(3, "smoke", "\"density\", \"heat\"")) << options[0];
}

TEST_F(SharingGrids, keepToASizeApart) {
  const Json report = reportOf("--size 2000");
  EXPECT_LE(sizeOf("out.esvr"), 2000u);
  EXPECT_TRUE(report["output"]["bytes_separate"].is_null());
}

TEST_F(SharingGrids, takeFewerBytesInTheFramesOfAFile) {
  for (int frame = 1; frame <= 3; ++frame)
    writeInput(folder_ / ("in.000" + std::to_string(frame) + ".vdb"),
               {{.name = "density", .voxels = softBall({frame, 0, 0})},
                {.name = "heat", .voxels = softBall({frame, 0, 0}, 40.0f)}});
  const Words command{
      folder_ / "in.####.vdb", out(),    "--frames", "1-3",       "--device", "cpu",
      "--representation",      "voxels", "--force",  "--measure", "values",   "--share"};
  std::vector<std::uint64_t> bytes;
  for (const char* share : {"off", "auto"}) {
    Words arguments = command;
    arguments.emplace_back(share);
    succeeded(vdb2esvr(arguments));
    bytes.push_back(sizeOf("out.esvr"));
  }
  EXPECT_LT(bytes[1], bytes[0]);
  succeeded(esvr2vdb({out(), folder_ / "back.####.vdb"}));
  const VolumeGrid source = readGrid(folder_ / "in.0003.vdb", "heat"),
                   found = readGrid(folder_ / "back.0003.vdb", "heat");
  EXPECT_GE(compareVolumes(source.volume, found.volume).psnrActive, kStandardPsnr);
}

TEST_F(SharingGrids, mayHaveGoalsOfTheirOwn) {
  const Json report = reportOf("--psnr 30,heat=50 --share off");
  const Json &density = report["grids"][0]["metrics"], &heat = report["grids"][1]["metrics"];
  EXPECT_GE(density["psnr_box"], 30.0);
  EXPECT_LT(density["psnr_box"], 40.0);
  EXPECT_GE(heat["psnr_box"], 50.0);
  EXPECT_EQ(report["asked"]["psnr"], 30.0);
  EXPECT_EQ(report["asked"]["goals"][0]["grid"], "heat");
}

TEST_F(SharingGrids, withTwoGoalsAreRefused) {
  for (const Words& options : {Words{"--psnr", "heat=40,heat=50"},
                               {"--psnr", "heat=40", "--max-error", "heat=1%"},
                               {"--psnr", "40", "--max-error", "1%"},
                               {"--psnr", "40,50"},
                               {"--psnr", "=40"},
                               {"--psnr", "heat=warm"},
                               {"--psnr", "heat=1000"},
                               {"--max-error", "heat=0"},
                               {"--psnr", "heat=40", "--size", "5000"},
                               {"--psnr", "heat=40", "--count", "10"}})
    EXPECT_THAT(run(options), Fails(2)) << testing::PrintToString(options);
}

/// Bytes of the name, the transform, the metadata and the rows of a grid at most.
constexpr std::uint64_t kBytesOfATwin = 600;

class Twins : public Conversion {
 protected:
  /// Runs vdb2esvr for these grids. \return the report
  Json reportOf(const std::vector<InputGrid>& grids, const Words& options) {
    writeInput(in(), grids);
    run_ = succeeded(convert(joined({"--device", "cpu", "--report", at("r.json")}, options)));
    return Json::parse(readText(at("r.json")));
  }
  ProgramRun run_;
};

const Words kQuick{"--count", "30", "--iterations", "60", "--representation", "ellipsoids"};

/// Three grids, of which the first and the last one have the same voxels.
std::vector<InputGrid> twoAlike() {
  return {{.name = "red", .voxels = softBall({})},
          {.name = "heat", .voxels = softBall({}, 2.0f)},
          {.name = "green", .voxels = softBall({}), .map = InputMap::kRotated}};
}

TEST_F(Twins, addTheirDescriptorsOnly) {
  for (const auto& options : {kQuick, Words{"--lossless"}}) {
    const std::vector<InputGrid> grids = twoAlike();
    reportOf({grids[0], grids[1]}, options);
    const std::uint64_t without = sizeOf("out.esvr");
    reportOf(grids, options);
    EXPECT_LT(sizeOf("out.esvr"), without + kBytesOfATwin) << options[0];
    EXPECT_THAT(readEsvr(out()).grids, testing::SizeIs(3));
  }
}

TEST_F(Twins, comeBackWithTheirOwnDescriptors) {
  reportOf(twoAlike(), "--lossless");
  const std::string back = folder_ / "back.vdb";
  succeeded(esvr2vdb({out(), back}));
  for (const char* name : {"red", "heat", "green"}) {
    const VolumeGrid source = readGrid(in(), name), found = readGrid(back, name);
    EXPECT_EQ(found.descriptor, source.descriptor) << name;
    EXPECT_EQ(found.volume.values, source.volume.values) << name;
    EXPECT_EQ(found.volume.active, source.volume.active) << name;
  }
}

TEST_F(Twins, areNamedByTheReportAndTheSummary) {
  const Json grids = reportOf(twoAlike(), kQuick)["grids"];
  EXPECT_TRUE(grids[0]["same_as"].is_null());
  EXPECT_TRUE(grids[1]["same_as"].is_null());
  EXPECT_EQ(grids[2]["same_as"], "red");
  EXPECT_EQ(grids[2]["metrics"], grids[0]["metrics"]);
  EXPECT_EQ(grids[2]["seconds"]["optimise"], 0.0);
  EXPECT_LT(grids[2]["bytes"], grids[0]["bytes"]);
  EXPECT_EQ(grids[2]["sections"][0]["shared"], true);
  EXPECT_THAT(run_.out, Says("green: stored once with red", Not(HasSubstr("heat: stored"))));
}

TEST_F(Twins, areListedWithoutCountingTheirBytesTwice) {
  const Json grids = reportOf(twoAlike(), "--lossless")["grids"];
  const auto list = esvr2vdb({"--list", out()});
  EXPECT_THAT(list.out, HasSubstr("shared with"));
  std::uint64_t sum = 0;
  for (const Json& grid : grids) sum += grid["bytes"].get<std::uint64_t>();
  EXPECT_LT(sum, sizeOf("out.esvr"));
  EXPECT_THAT(list.out, HasSubstr(" " + grids[2]["bytes"].dump() + " "));
}

TEST_F(Twins, ofATwinAreNamedAfterTheFirst) {
  const InputGrid ball{.voxels = softBall({})};
  const Json grids = reportOf({ball, ball, ball}, kQuick)["grids"];
  EXPECT_EQ(grids[1]["same_as"], "density[0]");
  EXPECT_EQ(grids[2]["same_as"], "density[0]");
}

TEST_F(Twins, RealFileHasThreeColoursInTheBytesOfOne) {
  if (std::string(ESVR_DATA_DIR).empty())
    GTEST_SKIP() << "needs the real volumes: configure with -DESVR_DATA_DIR=<their folder>";
  const std::string gas = std::string(ESVR_DATA_DIR) + "/sequence/gas_0001.vdb";
  const auto bytesOf = [&](const Words& names) {
    Words arguments{gas, out(), "--lossless", "--force"};
    for (const auto& name : names) arguments.insert(arguments.end(), {"-g", name});
    succeeded(vdb2esvr(arguments));
    return sizeOf("out.esvr");
  };
  const std::uint64_t one = bytesOf({"color_r"});
  EXPECT_LT(bytesOf({"color_r", "color_g", "color_b"}), one + 2 * kBytesOfATwin);
  const EsvrFile file = readEsvr(out());
  ASSERT_EQ(file.grids.size(), 3u);
  EXPECT_EQ(file.grids[2].descriptor.name, "color_b");
  EXPECT_EQ(decodeGrid(file.grids[2]).values, readGrid(gas, "color_b").volume.values);
}

}  // namespace
}  // namespace esvr::test
