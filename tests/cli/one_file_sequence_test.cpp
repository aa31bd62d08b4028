// Plan: sequences of small volumes are converted to one file and back as a user does. The file must have
// the same bytes on any number of threads, and after it was interrupted, killed and continued.
// Sequences of .esvr files are converted back. The frames must have the voxels of single conversions.
// Frames that are missing or damaged are treated as the options say.

#include <chrono>
#include <cmath>
#include <cstdint>

#include "cli/conversion.h"
#include "esvr/sequence_file.h"

namespace esvr::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

namespace fs = std::filesystem;
constexpr int kGroup = 16;  ///< frames of a group

class OneFile : public FolderTest {
 protected:
  void writeFrame(int number, const std::vector<InputGrid>& grids) const {
    writeInput(at("in." + std::to_string(number) + ".vdb"), grids);
  }
  /// Balls of different values as the frames first to last.
  void writeFrames(int first, int last) const {
    for (int frame = first; frame <= last; ++frame)
      writeFrame(frame, {{.voxels = softBall({frame, 0, 0}, float(20 + frame))}});
  }
  [[nodiscard]] Words wordsFor(const std::string& output, const Words& more) const {
    return joined({at("in.@.vdb"), at(output), "--lossless", "--device", "cpu"}, more);
  }
  [[nodiscard]] ProgramRun convert(const Words& more = {},
                                   const std::string& output = "out.esvr") const {
    return vdb2esvr(wordsFor(output, more));
  }
  [[nodiscard]] std::string bytesOf(const std::string& name) const { return readText(at(name)); }
  [[nodiscard]] std::vector<std::int64_t> numbersIn(const std::string& name) const {
    std::vector<std::int64_t> numbers;
    const SequenceReader reader(at(name));
    for (const SequenceFrame& frame : reader.frames()) numbers.push_back(frame.number);
    return numbers;
  }
  [[nodiscard]] std::vector<std::size_t> groupsIn(const std::string& name) const {
    std::vector<std::size_t> groups;
    const SequenceReader reader(at(name));
    for (const SequenceFrame& frame : reader.frames()) groups.push_back(frame.group);
    return groups;
  }
  void expectVoxels(SequenceReader& reader, std::int64_t frame, std::int64_t source) const {
    const auto in = readGrid(at("in." + std::to_string(source) + ".vdb"), "density").volume;
    EXPECT_EQ(decodeGrid(reader.read(frame).grids.at(0)).values, in.values) << frame;
  }
  void damage(const std::string& name, std::uint64_t byte) const {
    std::string bytes = bytesOf(name);
    bytes[byte] = char(bytes[byte] ^ 1);
    writeText(at(name), bytes);
  }
};

TEST_F(OneFile, hasTheFramesByTheirNumbers) {
  constexpr int kFrames = 2 * kGroup + 2;
  writeFrames(-3, kFrames - 4);
  EXPECT_THAT(succeeded(convert({"--report", at("r.json")})).out,
              HasSubstr("out.esvr: 3 groups of at most 16 frames"));
  EXPECT_THAT(outputs(), ElementsAre("out.esvr", "r.json"));
  const auto numbers = numbersIn("out.esvr");
  const auto groups = groupsIn("out.esvr");
  ASSERT_EQ(numbers.size(), std::size_t(kFrames));
  for (std::size_t i = 0; i < std::size_t(kFrames); ++i) {
    EXPECT_EQ(numbers[i], std::int64_t(i) - 3);
    EXPECT_EQ(groups[i], i / kGroup);
  }
  SequenceReader reader(at("out.esvr"));
  for (const std::int64_t frame : {kFrames - 4, -3, 0, kGroup}) expectVoxels(reader, frame, frame);
  const Json report = Json::parse(bytesOf("r.json"));
  EXPECT_EQ(report["output"]["bytes"], sizeOf("out.esvr"));
  EXPECT_EQ(report["output"]["groups"], 3);
  EXPECT_EQ(report["frames"][kFrames - 1]["group"], 2);
  EXPECT_EQ(report["frames"][9]["output"]["bytes"], reader.frames()[9].bytes);
}

TEST_F(OneFile, repeatsTheGridsOfFramesThatAreEqual) {
  const auto write = [&](int frame, float value) {
    writeFrame(frame,
               {{.voxels = cloud(12)}, {.name = "heat", .voxels = softBall({0, 0, 0}, value)}});
  };
  write(1, 20.0f), write(2, 20.0f), write(3, 30.0f);
  for (const Words& goal : std::vector<Words>{{"--size", "3000"}, {"--psnr", "40"}, {}}) {
    succeeded(vdb2esvr(
        joined({at("in.@.vdb"), at("out.esvr"), "--device", "cpu", "-f", "--report", at("r.json")},
               goal)));
    SequenceReader reader(at("out.esvr"));
    const auto voxels = [&](std::int64_t frame, std::size_t grid) {
      return decodeGrid(reader.read(frame).grids.at(grid)).values;
    };
    EXPECT_EQ(voxels(2, 0), voxels(1, 0));
    EXPECT_EQ(voxels(2, 1), voxels(1, 1));
    EXPECT_EQ(voxels(3, 0), voxels(1, 0)) << "one grid moves, the other one stands still";
    EXPECT_NE(voxels(3, 1), voxels(1, 1));
    const auto frames = reader.frames();
    EXPECT_LT(frames[1].bytes, frames[0].bytes / 2 + 200) << "all that was stored is stored again";
    const Json report = Json::parse(bytesOf("r.json"));
    const auto isAsBefore = [&](std::size_t frame, std::size_t grid) {
      return report["frames"][frame]["grids"][grid]["as_previous_frame"].get<bool>();
    };
    EXPECT_FALSE(isAsBefore(0, 0));
    EXPECT_TRUE(isAsBefore(1, 0) && isAsBefore(1, 1) && isAsBefore(2, 0));
    EXPECT_FALSE(isAsBefore(2, 1));
  }
}

TEST_F(OneFile, hasTheSameBytesOnAnyNumberOfThreads) {
  writeFrames(1, 2 * kGroup + 1);
  succeeded(convert("--threads 1"));
  succeeded(convert("--threads 4", "four.esvr"));
  EXPECT_TRUE(bytesOf("four.esvr") == bytesOf("out.esvr"));
  succeeded(convert("--frames 33-1", "down.esvr"));
  EXPECT_TRUE(bytesOf("down.esvr") == bytesOf("out.esvr")) << "frames are sorted";
}

TEST_F(OneFile, beginsAGroupWhereGridsDiffer) {
  writeFrames(1, 5);
  writeFrame(3, {{.voxels = softBall({}), .map = InputMap::kRotated}});
  writeFrame(5, {{.voxels = softBall({})}, {.name = "heat", .voxels = softBall({})}});
  const auto run = succeeded(convert());
  EXPECT_THAT(groupsIn("out.esvr"), ElementsAre(0, 0, 1, 2, 3));
  EXPECT_THAT(run.out, HasSubstr("frames 3-5 each begin a group, because their grids differ"));
}

TEST_F(OneFile, hasAnEmptyFrameInTheMiddle) {
  writeFrames(1, 3);
  writeFrame(2, {{}});
  succeeded(convert());
  EXPECT_THAT(numbersIn("out.esvr"), ElementsAre(1, 2, 3));
  succeeded(esvr2vdb({at("out.esvr"), at("back.@.vdb")}));
  EXPECT_EQ(inspectVdb(at("back.2.vdb")).grids.at(0).activeVoxels, 0u);
  EXPECT_GT(inspectVdb(at("back.3.vdb")).grids.at(0).activeVoxels, 0u);
}

// A frame that is predicted may use its bytes for more quality than the frame that it refers to. What counts
// are its bytes in the sequence, and not those of the same grid in a file of its own.
TEST_F(OneFile, keepsToTheSizeOfEveryFrame) {
  writeFrame(1, {{}});
  for (const int frame : {2, 3}) writeFrame(frame, {{.voxels = cloud(10)}});
  const SparseVolume source = readGrid(at("in.2.vdb"), "density").volume;
  for (const auto& goal : {Words{"--size", "1KB"}, Words{"--ratio", "40"}}) {
    succeeded(
        vdb2esvr(joined({at("in.@.vdb"), at("out.esvr"), "--device", "cpu", "--force"}, goal)));
    SequenceReader reader(at("out.esvr"));
    ASSERT_EQ(reader.frames().size(), 3u);
    const auto most = goal[0] == "--size" ? 1024u : std::uint64_t(sizeOf("in.3.vdb") / 40);
    EXPECT_LE(reader.frames()[2].bytes, most);
    const auto errorOf = [&](std::int64_t frame) {
      return compareVolumes(source, decodeGrid(reader.read(frame).grids.at(0)), {}).maxError;
    };
    EXPECT_LE(errorOf(3), errorOf(2));
  }
}

TEST_F(OneFile, holdsOrSkipsMissingFrames) {
  writeFrames(1, 2);
  writeFrames(5, 5);
  EXPECT_THAT(convert("--frames 1-5"), Fails(3));
  EXPECT_THAT(outputs(), IsEmpty());
  succeeded(convert("--frames 1-5 --missing skip"));
  EXPECT_THAT(numbersIn("out.esvr"), ElementsAre(1, 2, 5));
  writeFrames(6, 18);  // 16 frames have an input
  writeFrames(20, 20);
  const auto held = succeeded(convert("--frames 1-20 --missing hold", "held.esvr"));
  EXPECT_THAT(held.out, HasSubstr("held from 2"));
  const auto groups = groupsIn("held.esvr");
  ASSERT_EQ(groups.size(), 20u);
  EXPECT_EQ(groups[18], 0u) << "frame 19 holds the last frame of the first group";
  EXPECT_EQ(groups[19], 1u);
  SequenceReader reader(at("held.esvr"));
  for (const std::int64_t frame : {3, 4}) expectVoxels(reader, frame, 2);
}

TEST_F(OneFile, lacksFramesThatAreDamaged) {
  writeFrames(1, 4);
  writeText(at("in.2.vdb"), "no volume");
  EXPECT_THAT(convert(), Fails(3, "1 of 4 frames failed: 2"));
  EXPECT_THAT(numbersIn("out.esvr"), ElementsAre(1, 3, 4));
}

TEST_F(OneFile, isContinuedAfterItStopped) {
  writeFrames(1, kGroup + 4);
  succeeded(convert({}, "whole.esvr"));
  fs::rename(at("in.18.vdb"), at("in.eighteen"));
  writeText(at("in.18.vdb"), "no volume");
  EXPECT_THAT(convert("--on-error stop --threads 1"), Fails(3));
  EXPECT_THAT(outputs(), ElementsAre("out.esvr.partial", "out.esvr.partial.inputs", "whole.esvr"));
  EXPECT_THAT(convert(), Fails(1, "out.esvr.partial", "--resume"));
  EXPECT_THAT(convert("--resume --frames 2-20"), Fails(2, "has frame 1"));
  for (const char* other :
       {"--resume --effort 6", "--resume --nonfinite keep", "--resume -g density"})
    EXPECT_THAT(convert(other), Fails(2, "was begun with other options"));
  writeFrames(0, 0);
  EXPECT_THAT(convert("--resume"), Fails(2, "has other groups"));

  fs::remove(at("in.0.vdb"));
  fs::rename(at("in.eighteen"), at("in.18.vdb"));
  EXPECT_THAT(succeeded(convert("--resume")).out, HasSubstr("kept"));
  EXPECT_TRUE(bytesOf("out.esvr") == bytesOf("whole.esvr"));
  EXPECT_THAT(outputs(), ElementsAre("out.esvr", "whole.esvr"));
}

TEST_F(OneFile, isConvertedAgainFromTheFirstInputOnThatHasChanged) {
  writeFrames(1, 34);  // two groups, of which the second one holds a frame, and a frame that fails
  fs::rename(at("in.20.vdb"), at("in.twenty"));  // frame 20 holds frame 19
  fs::rename(at("in.34.vdb"), at("in.last"));
  const auto stop = [&] {
    fs::remove(at("out.esvr.partial"));
    writeText(at("in.34.vdb"), "no volume");
    EXPECT_THAT(convert("--on-error stop --threads 1 --missing hold --frames 1-34"), Fails(3));
    EXPECT_THAT(outputs(), ElementsAre("out.esvr.partial", "out.esvr.partial.inputs"));
    fs::copy_file(at("in.last"), at("in.34.vdb"), fs::copy_options::overwrite_existing);
  };
  const auto resumed = [&](const std::string& told) {
    const ProgramRun run = succeeded(convert("--resume --missing hold --frames 1-34"));
    EXPECT_EQ(run.err.find("is not as it was") != std::string::npos, !told.empty()) << run.err;
    EXPECT_THAT(run.err, HasSubstr(told));
    succeeded(convert("--missing hold --frames 1-34", "whole.esvr"));
    EXPECT_TRUE(bytesOf("out.esvr") == bytesOf("whole.esvr"));
    EXPECT_THAT(outputs(), ElementsAre("out.esvr", "whole.esvr"));
    fs::remove(at("out.esvr")), fs::remove(at("whole.esvr"));
  };
  stop(), resumed("");
  stop();
  writeFrame(18, {{.voxels = softBall({1, 2, 3}, 7.0f)}});
  resumed("in.18.vdb is not as it was when frame 18 was converted; the frames from 17 on are");
  stop();
  const auto changed = fs::last_write_time(at("in.2.vdb"));
  fs::last_write_time(at("in.2.vdb"),
                      changed - std::chrono::hours(1));  // another file of the same size
  resumed("in.2.vdb is not as it was when frame 2 was converted; the frames from 1 on are");
  stop();
  fs::rename(at("in.twenty"), at("in.20.vdb"));
  EXPECT_THAT(convert("--resume --missing hold --frames 1-34"), Fails(2, "has other groups"));
  fs::rename(at("in.20.vdb"), at("in.twenty"));
  stop();
  fs::remove(at("out.esvr.partial.inputs"));
  resumed("in.1.vdb is not as it was");
}

/// A sequence of a whole group and of a frame that takes seconds.
class SlowLastFrame : public OneFile {
 protected:
  SlowLastFrame() {
    writeFrames(1, kGroup);
    writeFrame(kGroup + 1, {{.voxels = cloud(60)}});
  }
  void makeQuick() const { writeFrames(kGroup + 1, kGroup + 1); }
  [[nodiscard]] Words wordsTo(const std::string& output) const {
    return {at("in.@.vdb"), at(output), "--device",  "cpu", "--representation", "voxels",
            "--psnr",       "40",       "--threads", "1",   "--progress",       "json"};
  }
  [[nodiscard]] ProgramRun resumed() const {
    Words words = wordsTo("out.esvr");
    words.emplace_back("--resume");
    return vdb2esvr(words);
  }
};

constexpr const char* kWithoutTheLast = "\"frames_done\":16";

TEST_F(SlowLastFrame, isConvertedAfterTheProgramWasKilled) {
  std::string command = std::string(VDB2ESVR);
  for (const std::string& word : wordsTo("out.esvr")) command += " '" + word + "'";
  const std::string log = "'" + at("log") + "'";
  EXPECT_EQ(runShell("touch " + log + "; " + command + " 2>" + log + " & until grep -q '" +
                     kWithoutTheLast + "' " + log +
                     "; do sleep 0.01; done; sleep 0.2; kill -9 $!; wait $!")
                .exitCode,
            128 + 9);
  EXPECT_TRUE(fs::exists(at("out.esvr.partial")));
  makeQuick();
  succeeded(vdb2esvr(wordsTo("whole.esvr")));
  succeeded(resumed());
  EXPECT_TRUE(bytesOf("out.esvr") == bytesOf("whole.esvr"));
}

TEST_F(SlowLastFrame, leavesTheCompleteGroupsWhereItIsInterrupted) {
  EXPECT_THAT(runInterrupted(VDB2ESVR, wordsTo("out.esvr"), kWithoutTheLast),
              Fails(1, "interrupted; 16 of 17 frames are complete, and --resume"));
  EXPECT_THAT(outputs(), ElementsAre("out.esvr.partial", "out.esvr.partial.inputs"));
  makeQuick();
  EXPECT_THAT(succeeded(resumed()).err, HasSubstr("\"kept\""));
  EXPECT_EQ(numbersIn("out.esvr").size(), std::size_t(kGroup + 1));
}

TEST_F(OneFile, isReplacedWhereForcedOnly) {
  writeFrames(1, 2);
  writeText(at("out.esvr"), "mine");
  EXPECT_THAT(convert(), Fails(1, "exists already"));
  EXPECT_EQ(bytesOf("out.esvr"), "mine");
  writeText(at("out.esvr.partial"), "a file of somebody else");
  EXPECT_THAT(convert("--force").err, HasSubstr("is no part of an .esvr file"));
  EXPECT_EQ(bytesOf("out.esvr.partial"), "a file of somebody else");
  EXPECT_EQ(bytesOf("out.esvr"), "mine");
  fs::remove(at("out.esvr.partial"));
  succeeded(convert("--force"));
  EXPECT_THAT(outputs(), ElementsAre("out.esvr"));
}

TEST_F(OneFile, comesBackByFrames) {
  writeFrames(1, 6);
  succeeded(convert());
  EXPECT_THAT(succeeded(esvr2vdb({at("out.esvr"), at("back.##.vdb"), "--frames", "5,2",
                                  "--reference", at("in.@.vdb")}))
                  .out,
              Says("frame 5:", "frame 2:"));
  EXPECT_THAT(outputs(), ElementsAre("back.02.vdb", "back.05.vdb", "out.esvr"));
  for (const std::string frame : {"2", "5"})
    EXPECT_EQ(readGrid(at("back.0" + frame + ".vdb"), "density").volume.values,
              readGrid(at("in." + frame + ".vdb"), "density").volume.values);
  EXPECT_THAT(esvr2vdb({at("out.esvr"), at("x.@.vdb"), "--frames", "5-7"}),
              Fails(3, "frame 7 is missing"));
  EXPECT_THAT(esvr2vdb({at("out.esvr"), at("x.vdb")}), Fails(2, "x.####.vdb"));
}

TEST_F(OneFile, isListedByFrames) {
  writeFrames(1, 3);
  writeFrame(3, {{.voxels = softBall({}), .map = InputMap::kRotated}});
  succeeded(convert());
  EXPECT_THAT(
      succeeded(esvr2vdb({"--list", at("out.esvr")})).out,
      Says("format 1.3", "3 frames in 2 groups", std::to_string(sizeOf("out.esvr")) + " bytes"));
}

TEST_F(OneFile, isCheckedFrameByFrame) {
  writeFrames(1, 4);
  succeeded(convert());
  EXPECT_THAT(esvr2vdb({"--check", at("out.esvr")}).out, HasSubstr("out.esvr: OK"));
  damage("out.esvr", SequenceReader(at("out.esvr")).frames()[3].offset + 60);
  EXPECT_THAT(esvr2vdb({"--check", at("out.esvr")}),
              Fails(3, "1 of 4 frames are lost: 4", "frame 4: "));
  const auto back = esvr2vdb({at("out.esvr"), at("back.@.vdb")});
  EXPECT_THAT(back, Fails(3, "1 of 4 frames failed: 4"));
  EXPECT_THAT(outputs(), ElementsAre("back.1.vdb", "back.2.vdb", "back.3.vdb", "out.esvr"));
}

TEST_F(OneFile, isDrawnFrameByFrame) {
  writeFrames(-1, 2);
  writeFrame(1, {{}});
  succeeded(convert());
  const auto draw = [&](const std::string& output, const Words& more) {
    return runProgram(
        ESVR_RENDER,
        joined({at("out.esvr"), at(output), "--resolution", "16x16", "--device", "cpu"}, more));
  };
  succeeded(draw("p.##.png", "--frames -1-2x1"));
  EXPECT_THAT(outputs(), ElementsAre("out.esvr", "p.-1.png", "p.00.png", "p.01.png", "p.02.png"));
  EXPECT_FALSE(bytesOf("p.00.png") == bytesOf("p.02.png")) << "one range of values for all";
  EXPECT_THAT(draw("p.png", {}).err, HasSubstr("needs a pattern"));
  EXPECT_THAT(draw("q.##.png", "--frames 7").err, HasSubstr("there is no frame 7"));
  EXPECT_THAT(draw("q.##.png", "--turntable 3").err,
              HasSubstr("--turntable cannot be combined with a sequence"));
}

/// A cloud whose waves move by a third of a voxel a frame, in 6 frames.
class MovingCloud : public OneFile {
 protected:
  MovingCloud() {
    for (int frame = 1; frame <= 6; ++frame) {
      auto voxels = cloud(14);
      for (InputVoxel& v : voxels)
        v.value *= 1.0f + 0.3f * std::sin(0.9f * (float(v.at.x) - float(frame) / 3.0f)) *
                              std::cos(0.7f * float(v.at.y + v.at.z));
      writeFrame(frame, {{.voxels = voxels}});
    }
  }
  [[nodiscard]] ProgramRun convertTo(const std::string& output, const Words& more) const {
    return vdb2esvr(joined({at("in.@.vdb"), at(output), "--device", "cpu", "--psnr", "40",
                            "--representation", "voxels"},
                           more));
  }
};

TEST_F(MovingCloud, takesFewerBytesThanFramesOfTheirOwn) {
  succeeded(convertTo("alone.@.esvr", {}));
  succeeded(convertTo("out.esvr", {"--report", at("r.json")}));
  double alone = 0.0;
  for (int frame = 1; frame <= 6; ++frame)
    alone += double(sizeOf("alone." + std::to_string(frame) + ".esvr"));
  EXPECT_LT(1.5 * double(sizeOf("out.esvr")), alone);
  SequenceReader reader(at("out.esvr"));
  for (const SequenceFrame& frame : reader.frames())
    EXPECT_EQ(frame.dependsOnPrevious, frame.number > 1) << frame.number;
  for (const Json& frame : Json::parse(bytesOf("r.json"))["frames"])
    EXPECT_GE(frame["grids"][0]["psnr_box"].get<double>(), 40.0);
}

/// Three frames as in.1.vdb and in.1.esvr, ...
class SequenceBack : public FolderTest {
 protected:
  void SetUp() override {
    for (const std::string frame : {"1", "2", "3"})
      writeInput(at("in." + frame + ".vdb"), {{.voxels = softBall({}, std::stof(frame))}});
    succeeded(quickFit(at("in.@.vdb"), at("in.@.esvr")));
  }
  [[nodiscard]] ProgramRun back(const Words& more = {},
                                const std::string& output = "out.%02d.vdb") const {
    return esvr2vdb(joined({at("in.@.esvr"), at(output)}, more));
  }
  [[nodiscard]] SparseVolume voxelsOf(const std::string& name) const {
    return readGrid(at(name), "density").volume;
  }
};

TEST_F(SequenceBack, hasTheVoxelsOfSingleFiles) {
  succeeded(back("--frames 1-3x2"));
  EXPECT_THAT(outputs(), ElementsAre("out.01.vdb", "out.03.vdb"));
  succeeded(esvr2vdb({at("in.3.esvr"), at("one.vdb")}));
  EXPECT_EQ(voxelsOf("out.03.vdb").values, voxelsOf("one.vdb").values);
  EXPECT_NE(voxelsOf("out.01.vdb").values, voxelsOf("one.vdb").values);
}

TEST_F(SequenceBack, isComparedWithASequence) {
  const auto run = succeeded(back({"--reference", at("in.@.vdb"), "--threads", "3"}));
  const std::size_t one = run.out.find("frame 1:"), three = run.out.find("frame 3:");
  EXPECT_LT(one, three) << "in their order";
  EXPECT_NE(three, std::string::npos);
  EXPECT_THAT(back({"--reference", at("in.1.vdb"), "-f"}), Fails(2)) << "no pattern";
}

TEST_F(SequenceBack, holdsOrSkipsMissingFrames) {
  EXPECT_THAT(back("--frames 2-4"), Fails(3));
  succeeded(back("--frames 2-4 --missing skip"));
  EXPECT_THAT(outputs(), ElementsAre("out.02.vdb", "out.03.vdb"));
  succeeded(back("--frames 2-4 --missing hold", "held.##.vdb"));
  EXPECT_EQ(voxelsOf("held.04.vdb").values, voxelsOf("out.03.vdb").values);
}

TEST_F(SequenceBack, namesDamagedFramesAndStopsWhereAsked) {
  writeText(at("in.2.esvr"), "no file of ellipsoids");
  EXPECT_THAT(back("--on-error stop --threads 1", "stop.##.vdb"), Fails(3));
  EXPECT_THAT(outputs(), ElementsAre("stop.01.vdb"));
  EXPECT_THAT(back(), Fails(3, "frame 2: ", "1 of 3 frames failed: 2"));
  EXPECT_THAT(outputs(), ElementsAre("out.01.vdb", "out.03.vdb", "stop.01.vdb"));
}

TEST_F(SequenceBack, isDecodedOneByOneWhereMemoryIsShort) {
  expectOneByOneWhereMemoryIsShort([&](const Words& options) { return back(options); });
}

TEST_F(SequenceBack, refusesWhatASequenceCannotHave) {
  EXPECT_THAT(back({}, "out.vdb"), Fails(2));
  EXPECT_THAT(esvr2vdb({"--list", at("in.1.esvr"), "--frames", "1"}), Fails(2));
  EXPECT_THAT(esvr2vdb({at("in.1.esvr"), at("out.vdb"), "--frames", "1"}), Fails(2));
  writeText(at("out.02.vdb"), "mine");
  EXPECT_THAT(back().err, HasSubstr("it exists already"));
  succeeded(back("--force"));
}

}  // namespace
}  // namespace esvr::test
