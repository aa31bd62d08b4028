// Plan: each frame of a sequence has the bytes of the conversion of its file alone, on any number of
// threads and beside any other frames, with all grids that are not fitted. The summary, the report and
// the warnings tell what became of each frame and grid, each thing once.

#include <algorithm>
#include <chrono>

#include "cli/conversion.h"
#include "esvr/encode.h"

namespace esvr::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

namespace fs = std::filesystem;
class SequenceFiles : public FolderTest {
 protected:
  /// Balls of different values in in.0001.vdb, in.0002.vdb, ...
  void writeFrames(int count) const {
    for (int frame = 1; frame <= count; ++frame)
      writeInput(at(nameOf("in", frame, "vdb")),
                 {{.voxels = softBall({frame, 0, 0}, float(frame))}});
  }
  static std::string nameOf(const std::string& start, int frame, const std::string& end) {
    std::string digits = std::to_string(frame);
    digits.insert(0, 4 - digits.size(), '0');
    return start + "." + digits + "." + end;
  }
  [[nodiscard]] ProgramRun convert(const Words& more = {},
                                   const std::string& output = "out.####.esvr") const {
    return vdb2esvr(joined({at("in.####.vdb"), at(output), "--device", "cpu"}, more));
  }
  /// Single fits, which take milliseconds.
  [[nodiscard]] ProgramRun convertQuickly(const Words& more = {}) const {
    return quickFit(at("in.####.vdb"), at("out.####.esvr"), more);
  }
  [[nodiscard]] bool isThere(const std::string& name) const { return fs::exists(at(name)); }
};

TEST_F(SequenceFiles, haveTheBytesOfSingleFilesOnAnyNumberOfThreads) {
  writeFrames(5);
  succeeded(convert("--threads 1"));
  succeeded(convert("--threads 4", "four.####.esvr"));
  succeeded(convert("--frames 5,2", "some.####.esvr"));
  for (int frame = 1; frame <= 5; ++frame) {
    succeeded(vdb2esvr({at(nameOf("in", frame, "vdb")), at("one.esvr"), "-f"}));
    const std::string one = readText(at("one.esvr"));
    EXPECT_EQ(readText(at(nameOf("out", frame, "esvr"))), one);
    EXPECT_EQ(readText(at(nameOf("four", frame, "esvr"))), one);
    const std::string some = nameOf("some", frame, "esvr");
    EXPECT_EQ(isThere(some), frame == 2 || frame == 5);
    if (isThere(some)) {
      EXPECT_EQ(readText(at(some)), one);
    }
  }
}

TEST_F(SequenceFiles, haveOneQualityWithoutAGoal) {
  // The first frame is smooth. The last one has waves, so that it needs more bytes.
  for (int frame = 1; frame <= 3; ++frame) {
    auto voxels = cloud(12);
    for (auto& voxel : voxels)
      voxel.value *= 1.0f + 0.2f * float(frame - 1) * float((voxel.at.x ^ voxel.at.y) & 1);
    writeInput(at(nameOf("in", frame, "vdb")), {{.voxels = voxels}});
  }
  const auto run = succeeded(convert("--report -"));
  const Json range = Json::parse(run.out)["grids"][0]["psnr_t50"];
  // The bound of quantised voxels is found to within some hundredths of a dB, but the frames take some
  // 500 bytes, of which another lattice with a higher PSNR may save a few.
  EXPECT_GE(range[0], qualityOf(Preset::kStandard).picturePsnr);
  EXPECT_LE(range[1], qualityOf(Preset::kStandard).picturePsnr + 6.0);
  EXPECT_GT(sizeOf("out.0003.esvr"), sizeOf("out.0001.esvr"));
}

TEST_F(SequenceFiles, mayBeHeldOrSkippedWhereTheyAreMissing) {
  writeFrames(2);
  writeInput(at("in.0005.vdb"), {{.voxels = softBall({})}});
  EXPECT_THAT(convertQuickly("--frames 1-5"), Fails(3, "frames 3-4 are missing"));
  EXPECT_THAT(outputs(), IsEmpty());

  succeeded(convertQuickly("--frames 1-5 --missing skip"));
  EXPECT_THAT(outputs(), ElementsAre("out.0001.esvr", "out.0002.esvr", "out.0005.esvr"));

  const auto held = succeeded(convertQuickly("--frames 1-5 --missing hold -f"));
  EXPECT_THAT(held.out, HasSubstr("held from 2"));
  for (const char* name : {"out.0003.esvr", "out.0004.esvr"})
    EXPECT_EQ(readText(at(name)), readText(at("out.0002.esvr")));
}

TEST_F(SequenceFiles, areNamedWhereTheyAreDamaged) {
  writeFrames(4);
  writeText(at("in.0002.vdb"), "no volume");
  EXPECT_THAT(convertQuickly({"--report", at("r.json"), "--frames", "1-5", "--missing", "hold",
                              "--threads", "1"}),
              Fails(3, "vdb2esvr: frame 2: ", "in.0002.vdb", "1 of 5 frames failed: 2"));
  EXPECT_FALSE(isThere("out.0002.esvr"));
  for (const char* name : {"out.0001.esvr", "out.0003.esvr", "out.0004.esvr", "out.0005.esvr"})
    EXPECT_TRUE(isThere(name)) << name;
  const Json report = Json::parse(readText(at("r.json")));
  EXPECT_EQ(report["exit_code"], 3);
  EXPECT_EQ(report["states"]["failed"], 1);
  EXPECT_EQ(report["frames"][1]["state"], "failed");
  EXPECT_EQ(report["frames"][1]["error"]["kind"], "bad input");
}

TEST_F(SequenceFiles, stopAfterADamagedOneWhereAsked) {
  writeFrames(4);
  writeText(at("in.0002.vdb"), "no volume");
  const auto run = convertQuickly("--on-error stop --threads 1");
  EXPECT_EQ(run.exitCode, 3);
  EXPECT_THAT(run.out, HasSubstr("not begun"));
  EXPECT_THAT(outputs(), ElementsAre("out.0001.esvr"));
}

TEST_F(SequenceFiles, thatHoldADamagedOneFailToo) {
  writeFrames(2);
  writeText(at("in.0002.vdb"), "no volume");
  EXPECT_THAT(convertQuickly("--frames 1-3 --missing hold"),
              Fails(3, "frame 3: frame 2, which it holds, failed", "2 of 3 frames failed: 2-3"));
}

TEST_F(SequenceFiles, areOneFileIfThePatternIsInTheNameOfAFolder) {
  writeFrames(2);
  const std::string file = "out.####/all.esvr";
  EXPECT_THAT(convert({}, file), Fails(1)) << "there is no folder out.####";
  EXPECT_THAT(outputs(), IsEmpty());
  fs::create_directories(at("out.####"));
  succeeded(convert({}, file));
  EXPECT_TRUE(isThere(file));
}

TEST_F(SequenceFiles, withoutActiveVoxelsHaveNoSizeToKeepTo) {
  writeFrames(1);
  writeInput(at("in.0002.vdb"), {{.name = "density"}});
  writeInput(at("in.0003.vdb"), {{.name = "density"}, {.name = "flame"}});
  for (const char* output : {"out.####.esvr", "out.esvr"}) {
    succeeded(convert("--ratio 100 --frames 2-3", output));
    succeeded(convert("--size 5KB -f", output));
  }
}

TEST_F(SequenceFiles, haveASizeBesideAGridOfAFewVoxels) {
  for (int frame = 1; frame <= 2; ++frame)
    writeInput(at(nameOf("in", frame, "vdb")),
               {{.voxels = cloud(12)},
                {.name = "flame", .voxels = {{{0, 0, 0}, 0.0f}, {{0, 0, 1}, 0.0f}}}});
  succeeded(convert("--size 1500"));
  for (int frame = 1; frame <= 2; ++frame)
    EXPECT_LE(fs::file_size(at(nameOf("out", frame, "esvr"))), 1500u);
}

TEST_F(SequenceFiles, areReportedWithAnEntryEach) {
  writeFrames(3);
  const auto run = succeeded(convertQuickly("--report - --frames 3,1"));
  const Json report = Json::parse(run.out);
  EXPECT_EQ(report["schema"], "esvr-sequence");
  EXPECT_EQ(report["asked"]["count"], 30);
  EXPECT_EQ(report["frames"][0]["frame"], 3);
  EXPECT_EQ(report["frames"][1]["output"]["bytes"], sizeOf("out.0001.esvr"));
  const Json& grid = report["frames"][1]["grids"][0];
  EXPECT_EQ(grid["ellipsoids"], readEsvr(at("out.0001.esvr")).grids[0].field.ellipsoidCount());
  const double first = grid["metrics"]["psnr_active"];
  const double third = report["frames"][0]["grids"][0]["metrics"]["psnr_active"];
  EXPECT_THAT(report["grids"][0]["psnr_active"],
              ElementsAre(std::min(first, third), std::max(first, third)));
  const double thin = grid["quality"]["psnr_t50"];
  const double other = report["frames"][0]["grids"][0]["quality"]["psnr_t50"];
  EXPECT_THAT(report["grids"][0]["psnr_t50"],
              ElementsAre(std::min(thin, other), std::max(thin, other)));
}

TEST_F(SequenceFiles, areReportedAlsoWhereNothingCanBeConverted) {
  EXPECT_THAT(convertQuickly({"--report", at("r.json")}), Fails(3));
  EXPECT_EQ(Json::parse(readText(at("r.json")))["error"]["kind"], "bad input");
}

TEST_F(SequenceFiles, tellTheirProgressAsJson) {
  writeFrames(3);
  writeText(at("in.0003.vdb"), "no volume");
  std::istringstream lines(convertQuickly("--progress json").err);
  std::vector<Json> progress;
  for (std::string line; std::getline(lines, line);)
    if (line.starts_with("{")) progress.push_back(Json::parse(line));
  ASSERT_EQ(progress.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(progress[i]["frames_done"], i + 1);
  EXPECT_EQ(progress[2]["fraction"], 1.0);
  EXPECT_EQ(progress[2]["frames_failed"], 1);
  EXPECT_EQ(progress[2]["frames"], 3);
}

TEST_F(SequenceFiles, keepExistingFilesUnlessForced) {
  writeFrames(2);
  writeText(at("out.0002.esvr"), "mine");
  EXPECT_THAT(convertQuickly(), Fails(1, "out.0002.esvr: it exists already"));
  EXPECT_FALSE(isThere("out.0001.esvr")) << "nothing begins";
  succeeded(convertQuickly("--force"));
  EXPECT_NE(readText(at("out.0002.esvr")), "mine");
}

TEST_F(SequenceFiles, areContinuedWhereTheyAreMissingOnly) {
  writeFrames(3);
  writeText(at("out.0002.esvr"), "mine");
  EXPECT_THAT(succeeded(convertQuickly("--resume")).out, HasSubstr("kept"));
  EXPECT_EQ(readText(at("out.0002.esvr")), "mine");
  EXPECT_TRUE(isThere("out.0001.esvr") && isThere("out.0003.esvr"));
}

TEST_F(SequenceFiles, areConvertedAgainWhereTheirInputsHaveChanged) {
  writeFrames(4);
  fs::remove(at("in.0003.vdb"));
  const Words held{"--missing", "hold", "--frames", "1-4"};
  succeeded(convertQuickly(held));
  const std::string before = readText(at("out.0003.esvr"));
  writeText(at("out.0001.esvr"), "mine");
  writeInput(at("in.0002.vdb"), {{.voxels = softBall({5, 0, 0}, 9.0f)}});
  const auto later = fs::last_write_time(at("out.0003.esvr")) + std::chrono::hours(1);
  fs::last_write_time(at("in.0002.vdb"), later);
  const ProgramRun run = succeeded(convertQuickly(joined(held, {"--resume"})));
  EXPECT_THAT(run.err, Says("frame 2 is converted again", "in.0002.vdb", "is newer than"));
  EXPECT_EQ(readText(at("out.0001.esvr")), "mine");
  EXPECT_NE(readText(at("out.0002.esvr")), before);
  EXPECT_EQ(readText(at("out.0003.esvr")), readText(at("out.0002.esvr")));
}

TEST_F(SequenceFiles, thatAreCompleteStayAfterAnInterruption) {
  writeFrames(2);
  writeInput(at("in.0003.vdb"), {{.voxels = cloud(30)}});  // it takes seconds
  const Words inOrder{"--representation", "ellipsoids", "--threads", "1"};
  Words arguments = joined(
      {at("in.####.vdb"), at("out.####.esvr"), "--progress", "json", "--device", "cpu"}, inOrder);
  EXPECT_THAT(runInterrupted(VDB2ESVR, arguments, "\"frames_done\":2"),
              Fails(1, "interrupted; 2 of 3 frames are complete, and --resume"));
  EXPECT_THAT(outputs(), ElementsAre("out.0001.esvr", "out.0002.esvr"));

  writeInput(at("in.0003.vdb"), {{.voxels = softBall({})}});
  arguments.emplace_back("--resume");
  EXPECT_THAT(succeeded(vdb2esvr(arguments)).err, Says("\"kept\"", "\"converted\""));
  EXPECT_THAT(outputs(), ElementsAre("out.0001.esvr", "out.0002.esvr", "out.0003.esvr"));
}

TEST_F(SequenceFiles, thatMissTheirPsnrAreNamed) {
  writeFrames(3);
  EXPECT_THAT(convert("--psnr 90 --count 5 --representation ellipsoids --iterations 20"),
              Fails(4, "3 of 3 frames did not reach the PSNR: 1-3"));
  EXPECT_TRUE(isThere("out.0001.esvr"));
}

TEST_F(SequenceFiles, areConvertedOneByOneWhereMemoryIsShort) {
  writeFrames(3);
  expectOneByOneWhereMemoryIsShort([&](const Words& options) { return convertQuickly(options); });
}

TEST_F(SequenceFiles, thatHaveTheNameOfAPatternAreFiles) {
  writeInput(at("take#2.vdb"), {{.voxels = softBall({})}});
  succeeded(quickFit(at("take#2.vdb"), at("out.esvr")));
  EXPECT_TRUE(isThere("out.esvr"));
}

class RefusedSequence : public SequenceFiles, public testing::WithParamInterface<Refusal> {};

TEST_P(RefusedSequence, saysWhy) {
  writeFrames(2);
  GetParam().expectOf(vdb2esvr(GetParam().argumentsIn(folder_)));
  EXPECT_THAT(outputs(), IsEmpty());
}

INSTANTIATE_TEST_SUITE_P(
    Options, RefusedSequence,
    testing::Values(
        Refusal{"DIR/in.####.vdb DIR/out.png", 2, "must end in .esvr"},
        Refusal{
            {"DIR/in.0001.vdb", "DIR/out.esvr", "--frames", "1"}, 2, "--frames needs a sequence"},
        Refusal{"DIR/in.0001.vdb DIR/out.esvr --missing skip", 2, "--missing needs"},
        Refusal{"DIR/in.0001.vdb DIR/out.esvr --on-error stop", 2, "--on-error needs"},
        Refusal{
            {"DIR/in.####.vdb", "DIR/out.####.esvr", "--frames", "1-x"}, 2, "'1-x' is no range"},
        Refusal{"DIR/in.####.vdb DIR/out.####.esvr --missing x", 2, "error, hold, skip"},
        Refusal{"DIR/in.####.vdb DIR/out.####.esvr --on-error x", 2, "continue, stop"},
        Refusal{"DIR/in.####.vdb DIR/out.####.png", 2, "must end in .esvr"},
        Refusal{"DIR/in.@.vdb DIR/out.@.esvr", 3, "has another number of digits"},
        Refusal{"DIR/no.####.vdb DIR/out.####.esvr", 3, "no file matches"},
        Refusal{"DIR/in.####.vdb DIR/out.####.esvr --resume -f", 2, "choose one"}));

/// Three frames with the grids bool, int32, vec3s, points and density.
class CarriedSequence : public FolderTest {
 protected:
  void SetUp() override {
    for (int frame = 1; frame <= 3; ++frame)
      writeMixedInput(in(frame), {{.voxels = softBall({frame, 0, 0})}});
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
  [[nodiscard]] ProgramRun convert(const Words& more = {}) const {
    return quickFit(at("in.@.vdb"), at("out.@.esvr"), more);
  }
  [[nodiscard]] ProgramRun convertBack(const std::string& output, const Words& more = {}) const {
    return esvr2vdb(joined({at("out.@.esvr"), at(output), "--threads", "3"}, more));
  }
};

TEST_F(CarriedSequence, GivesAllGridsOfEachFrameBackInOrder) {
  succeeded(convert("--threads 3"));
  succeeded(convertBack("back.@.vdb"));
  for (int frame = 1; frame <= 3; ++frame) {
    EXPECT_EQ(namesIn(back(frame)), namesIn(in(frame)));
    EXPECT_EQ(carriedIn(back(frame), {0, 1, 2, 3}), carriedIn(in(frame), {0, 1, 2, 3}));
    succeeded(quickFit(in(frame), at("one.esvr"), "-f"));
    EXPECT_EQ(readText(out(frame)), readText(at("one.esvr"))) << "that of the file";
  }
}

TEST_F(CarriedSequence, KeepsAndLeavesOutTheNamedGridsOfEachFrame) {
  EXPECT_THAT(succeeded(convert("--keep density --skip bool --skip points")).out,
              Says("bool: left out in 3 frames, because --skip names it",
                   "density: carried unchanged in 3 frames, because --keep names it",
                   "int32: carried unchanged in 3 frames, because its values"));
  succeeded(convertBack("back.@.vdb"));
  for (int frame = 1; frame <= 3; ++frame) {
    EXPECT_THAT(namesIn(back(frame)), ElementsAre("int32", "vec3s", "density"));
    EXPECT_EQ(carriedIn(back(frame)), carriedIn(in(frame), {1, 2, 4}));
  }
}

TEST_F(CarriedSequence, WarnsOnceWhereNoFrameHasAFittedGrid) {
  const auto run = succeeded(convert("--keep density"));
  EXPECT_EQ(timesIn(run.err, "warning"), 1u) << run.err;
  EXPECT_THAT(run.err, HasSubstr("warning: frames 1-3: no grid is fitted"));
  EXPECT_THAT(run.out, HasSubstr("bytes, 1 : ")) << "carried grids count";
  EXPECT_EQ(convert("--keep density --quiet -f").err, "");
}

TEST_F(CarriedSequence, HasCarriedGridsInTheReportOfEachFrame) {
  const auto run = succeeded(convert("--report - --skip bool"));
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
  writeInput(in(2), {{.voxels = softBall({})}});
  EXPECT_THAT(convert("--keep vec3s"),
              Fails(3, "frame 2: ", "no grid \"vec3s\"", "1 of 3 frames failed: 2"));
  EXPECT_EQ(readEsvr(out(3)).carried.size(), 4u);
}

TEST_F(CarriedSequence, WarnsOnceOfGridsThatTheOutputCannotHold) {
  succeeded(convert());
  const auto nano = succeeded(convertBack("back.@.nvdb"));
  EXPECT_EQ(timesIn(nano.err, "grid \"vec3s\" is left out"), 1u) << nano.err;
  EXPECT_THAT(nano.err,
              Says("warning: frames 1-3: grid \"vec3s\" is left out",
                   "frames 1-3: a NanoVDB file holds no metadata", Not(HasSubstr("back.1.nvdb"))));
  EXPECT_THAT(convertBack("no.@.nvdb", "-g vec3s"),
              Fails(2, "no.1.nvdb: grid \"vec3s\" cannot be written"));
}

}  // namespace
}  // namespace esvr::test
