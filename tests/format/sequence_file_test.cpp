// Plan: frames of every form of voxels come back bit for bit, in any order, with as few bytes read as the
// format promises, and take no more bytes than files of their own. Sequences are left incomplete at any
// byte, and a frame without its predecessor, with another one or with damage is refused.

#include "esvr/sequence_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <malloc.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "fit/volumes.h"
#include "format/sample_files.h"
#include "format/section_table.h"
#include "support/files.h"
#include "support/messages.h"

namespace esvr::test {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::IsEmpty;
using Groups = std::vector<std::vector<std::int64_t>>;

/// Metadata of a file. stringItem of esvr/vdb_io.h would link the test with OpenVDB.
MetaItem creator(const std::string& name) { return {"creator", "string", bytesOf(name)}; }

// ---- Frames

/// A ball that moves along z by a voxel a frame, with soft values in steps of 1/64.
SparseVolume ballAt(double frame, int bricks = 4) {
  return volumeOf({}, bricks, 0.0f, [&](Coord v) {
    const double x = v.x - 14.0, y = v.y - 15.0, z = v.z - 12.0 - frame;
    const double value = 1.2 - std::sqrt(x * x + y * y + z * z) / 9.0;
    return float(std::floor(std::max(value, 0.0) * 64.0) / 64.0);
  });
}

EsvrFile voxelFileOf(const SparseVolume& volume, VoxelLayer layer) {
  GridDescriptor descriptor;
  descriptor.name = "density";
  return {{}, {makeStoredVoxels(descriptor, volume, std::move(layer))}};
}

EsvrFile boundedFile(double frame, double bound = 0.01) {
  const SparseVolume volume = ballAt(frame);
  return voxelFileOf(volume, boundedLayer(volume, bound, Activity::kByValue));
}

void expectSame(const EsvrFile& a, const EsvrFile& b) {
  ASSERT_EQ(a.grids.size(), b.grids.size());
  EXPECT_EQ(encodeEsvr(a), encodeEsvr(b));  // the records bit for bit
  for (std::size_t g = 0; g < a.grids.size(); ++g) EXPECT_EQ(a.grids[g].voxels, b.grids[g].voxels);
}

/// Encodes and decodes a frame after another one. \return its bytes
std::vector<std::byte> expectComesBack(const EsvrFile& frame, const EsvrFile& previous) {
  auto bytes = encodeFrame(frame, &previous);
  expectSame(decodeFrame(bytes, "frame", {}, &previous), frame);
  EXPECT_LE(bytes.size(), encodeEsvr(frame).size());
  return bytes;
}

/// A layer of every form from one volume.
std::vector<VoxelLayer> layersOfAllForms(double frame) {
  const SparseVolume palette = ballAt(frame);
  SparseVolume halves = palette, floats = palette;
  Random random(3);
  for (float& v : halves.values) v = float(std::floor(random(0.0, 8192.0)) / 4096.0);
  for (float& v : floats.values) v += 1e-4f * v * v;
  for (float& v : floats.values) v *= 1.0f + 1e-3f * float(random(0.0, 1.0));
  return {boundedLayer(palette, 0.01, Activity::kByValue),
          boundedLayer(palette, 0.02, Activity::kExact), exactLayer(halves), exactLayer(floats),
          exactLayer(palette)};
}

TEST(FrameCoding, BringsBackEveryFormAfterEveryForm) {
  const SparseVolume volume = ballAt(1.0);
  for (const VoxelLayer& before : layersOfAllForms(0.0))
    for (const VoxelLayer& now : layersOfAllForms(1.0))
      expectComesBack(voxelFileOf(volume, now), voxelFileOf(volume, before));
}

TEST(FrameCoding, SavesBytesOfASlowMotion) {
  const EsvrFile previous = boundedFile(0.0), frame = boundedFile(0.1);
  const auto bytes = expectComesBack(frame, previous);
  EXPECT_TRUE(dependsOnPrevious(bytes));
  EXPECT_LT(bytes.size(), encodeEsvr(frame).size() - 56);  // less than the row that it saves
}

/// Nothing but the table, the record's place, the checksum and a few decisions for each brick is
/// left.
TEST(FrameCoding, RepeatsAnEqualFrameInFewBytes) {
  const EsvrFile frame = boundedFile(0.0);
  EXPECT_LT(expectComesBack(frame, frame).size(), 50u);
}

/// A frame with metadata, a vector and a carried grid.
EsvrFile richFile(double frame) {
  EsvrFile file = boundedFile(frame);
  for (int more = 0; more < 3; ++more) file.grids.push_back(file.grids.front());
  file.metadata = {creator("a program")};
  file.vectors = {{"velocity", 1}};
  CarriedGrid carried;
  carried.name = "points", carried.treeType = "Tree_ptdataidx32_5_4_3", carried.vdbVersion = 224;
  carried.bytes.resize(5000, std::byte{7});
  file.carried = {carried};
  return file;
}

TEST(FrameCoding, DoesNotRepeatWhatThePreviousFrameHas) {
  const EsvrFile previous = richFile(0.0);
  const EsvrFile frame = richFile(0.1);
  const auto bytes = encodeFrame(frame, &previous);
  const EsvrFile back = decodeFrame(bytes, "frame", {}, &previous);
  EXPECT_EQ(back.metadata, frame.metadata);
  EXPECT_EQ(back.vectors, frame.vectors);
  EXPECT_EQ(back.carried, frame.carried);
  expectSame(back, frame);
  // The four grids have the same difference, which is stored once.
  const EsvrFile alone = boundedFile(0.1), before = boundedFile(0.0);
  EXPECT_LT(bytes.size(), encodeFrame(alone, &before).size() + 50);
}

TEST(FrameCoding, StoresWhatThePreviousFrameHasNot) {
  const EsvrFile previous = richFile(0.0);
  EsvrFile frame = richFile(0.1);
  frame.metadata = {creator("another program")};
  frame.vectors = {{"wind", 1}};
  frame.carried.front().bytes.resize(6000, std::byte{8});
  const EsvrFile back = decodeFrame(encodeFrame(frame, &previous), "frame", {}, &previous);
  EXPECT_EQ(back.metadata, frame.metadata);
  EXPECT_EQ(back.vectors, frame.vectors);
  EXPECT_EQ(back.carried, frame.carried);
}

TEST(FrameCoding, RefusesEveryChangedBitAndEveryTruncation) {
  const EsvrFile previous = richFile(0.0);
  auto bytes = encodeFrame(richFile(0.1), &previous);
  ASSERT_TRUE(dependsOnPrevious(bytes));
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    bytes[at] ^= std::byte(1 << at % 8);
    EXPECT_THROW((void)decodeFrame(bytes, "frame", {}, &previous), BadInput) << at;
    bytes[at] ^= std::byte(1 << at % 8);
    EXPECT_THROW((void)decodeFrame(std::span(bytes).first(at), "frame", {}, &previous), BadInput);
  }
}

TEST(FrameCoding, FollowsMotionsOfWholeVoxels) {
  const EsvrFile previous = boundedFile(0.0), near = boundedFile(2.0);
  const auto bytes = expectComesBack(near, previous);
  EXPECT_LT(2 * bytes.size(), encodeEsvr(near).size());
}

TEST(FrameCoding, BringsBackOtherBricksAndOrigins) {
  const SparseVolume small = ballAt(0.0, 2), large = ballAt(3.0, 4);
  SparseVolume moved = large;
  moved.origin = {-16, 8, 24};
  const auto file = [](const SparseVolume& volume) {
    return voxelFileOf(volume, boundedLayer(volume, 0.01, Activity::kByValue));
  };
  const std::array files{file(small), file(large), file(moved)};
  for (const EsvrFile& before : files)
    for (const EsvrFile& now : files) expectComesBack(now, before);
}

TEST(FrameCoding, BringsBackAnotherLattice) {
  expectComesBack(boundedFile(0.5, 0.01), boundedFile(0.0, 0.013));
  expectComesBack(boundedFile(0.5, 0.02), boundedFile(0.0, 0.0003));
}

TEST(FrameCoding, BringsBackEmptyFrames) {
  const EsvrFile full = boundedFile(0.0), none;
  EsvrFile empty = full;
  empty.grids.front().voxels = VoxelLayer{};
  const std::array files{full, empty, none};
  for (const EsvrFile& before : files)
    for (const EsvrFile& now : files) expectComesBack(now, before);
}

TEST(FrameCoding, HasTheBytesOfAFileWithoutAPreviousFrame) {
  const EsvrFile frame = boundedFile(0.0);
  const auto bytes = encodeFrame(frame, nullptr);
  EXPECT_EQ(bytes, encodeEsvr(frame));
  EXPECT_FALSE(dependsOnPrevious(bytes));
  expectSame(decodeFrame(bytes, "frame", {}, nullptr), frame);
}

TEST(FrameCoding, FallsBackWhereThePreviousFrameHasNoVoxels) {
  const EsvrFile frame = boundedFile(0.0);
  EsvrFile previous = frame;
  previous.grids.front().voxels.reset();
  EXPECT_FALSE(dependsOnPrevious(expectComesBack(frame, previous)));
}

TEST(FrameCoding, IsDeterministic) {
  const EsvrFile previous = boundedFile(0.0), frame = boundedFile(0.7);
  EXPECT_EQ(encodeFrame(frame, &previous), encodeFrame(frame, &previous));
}

TEST(FrameCoding, CountsTheBytesOfAGrid) {
  const EsvrFile previous = boundedFile(0.0), frame = boundedFile(0.1);
  const std::uint64_t header = bytesBesideGrids({});
  EXPECT_GE(header + bytesInFrame(frame.grids[0], &previous.grids[0]),
            encodeFrame(frame, &previous).size());
  EXPECT_EQ(bytesInFrame(frame.grids[0], nullptr), bytesAdded(frame.grids[0]));
}

TEST(FrameCoding, RefusesAMissingPreviousFrame) {
  const EsvrFile previous = boundedFile(0.0), none;
  const auto bytes = encodeFrame(boundedFile(0.1), &previous);
  EXPECT_THAT(
      [&] { (void)decodeFrame(bytes, "f.esvr, frame 2", {}, nullptr); },
      ThrowsSaying<BadInput>("f.esvr, frame 2: it cannot be read without the frame before"));
  EXPECT_THAT([&] { (void)decodeFrame(bytes, "f.esvr, frame 2", {}, &none); },
              ThrowsSaying<BadInput>("the frame before has only 0 grids"));
}

/// With another previous frame, a reader gets other voxels or an error, but never fails otherwise.
TEST(FrameCoding, SurvivesAnotherPreviousFrame) {
  const EsvrFile previous = boundedFile(0.0), other = boundedFile(5.0, 0.5);
  const auto bytes = encodeFrame(boundedFile(0.1), &previous);
  try {
    EXPECT_EQ(decodeFrame(bytes, "frame", {}, &other).grids.size(), 1u);
  } catch (const BadInput&) {
  }
}

TEST(FrameCoding, KeepsToTheLimitOfMemory) {
  const EsvrFile frame = boundedFile(0.0);
  const auto bytes = encodeFrame(frame, &frame);
  const ReadLimits limits{.maxBytes = 16 << 10};
  EXPECT_THROW((void)decodeFrame(bytes, "frame", limits, &frame), MemoryExceeded);
}

// ---- Files

const Groups kGroups{{-7, -6, -3}, {0, 1, 2, 4}, {9}};

class SequenceFile : public testing::Test {
 protected:
  [[nodiscard]] fs::path path() const { return folder_ / "a.esvr"; }
  [[nodiscard]] fs::path partial() const { return SequenceWriter::partialPath(path()); }
  void expectFrame(SequenceReader& reader, std::int64_t number) const {
    EXPECT_EQ(difference(reader.read(number), sampleFrame(number)), "") << number;
  }
  void append(SequenceWriter& writer, const std::vector<std::int64_t>& group) const {
    for (const std::int64_t number : group)
      writer.append(number, encodeFrame(sampleFrame(number), nullptr));
  }
  template <class Refused>
  static void expectRefused(const std::function<void()>& action, const char* words) {
    EXPECT_THAT(action, ThrowsSaying<Refused>(words));
  }
  TemporaryFolder folder_;
};

TEST_F(SequenceFile, GivesItsFramesInAnyOrder) {
  writeSequence(path(), kGroups);
  EXPECT_THAT(folder_.names(), ElementsAre("a.esvr"));
  EXPECT_TRUE(holdsSequence(path()));
  SequenceReader reader(path());
  EXPECT_EQ(reader.groupCount(), 3u);
  std::vector<std::int64_t> numbers;
  std::vector<std::size_t> groups;
  for (const SequenceFrame& frame : reader.frames())
    numbers.push_back(frame.number), groups.push_back(frame.group);
  EXPECT_THAT(numbers, ElementsAre(-7, -6, -3, 0, 1, 2, 4, 9));
  EXPECT_THAT(groups, ElementsAre(0, 0, 0, 1, 1, 1, 1, 2));
  for (const std::int64_t number : {9, -7, 4, 4, 0, -3, -6, 1, 2}) expectFrame(reader, number);
  for (const std::int64_t number : {-8, 3, 10})
    expectRefused<BadInput>([&] { (void)reader.read(number); }, "there is no frame");
  EXPECT_THAT(checkSequence(path()), IsEmpty());
}

/// The bytes of some frames, by their indices.
std::uint64_t bytesOfFrames(const SequenceReader& reader, std::size_t first, std::size_t last) {
  std::uint64_t bytes = 0;
  for (std::size_t i = first; i <= last; ++i) bytes += reader.frames()[i].bytes;
  return bytes;
}

TEST_F(SequenceFile, HasTheBytesOfTheGoldenOne) {
  writeGoldenSequence(path());
  if (std::getenv("ESVR_UPDATE_GOLDEN"))
    fs::copy(path(), ESVR_GOLDEN_SEQUENCE, fs::copy_options::overwrite_existing);
  EXPECT_EQ(bytesIn(path()), bytesIn(ESVR_GOLDEN_SEQUENCE));
}

TEST_F(SequenceFile, IsOpenedByReadingItsIndexAlone) {
  writeSequence(path(), kGroups);
  const SequenceReader reader(path());
  const SequenceFrame& last = reader.frames().back();
  // The magic number is read twice: alone, and with the header.
  EXPECT_LE(reader.bytesRead(), reader.fileBytes() - (last.offset + last.bytes) +
                                    format::kMagic.size() + format::kHeaderBytes);
}

TEST_F(SequenceFile, ReadsAFrameThatRefersToNoneAlone) {
  writeSequence(path(), kGroups);
  SequenceReader reader(path());
  const std::uint64_t opened = reader.bytesRead();
  expectFrame(reader, 2);
  EXPECT_EQ(reader.bytesRead() - opened, bytesOfFrames(reader, 5, 5));
}

TEST_F(SequenceFile, ReadsAtMostTheFramesOfAGroupForOneFrame) {
  writeChains(path(), kGroups);
  EXPECT_THAT(checkSequence(path()), IsEmpty());
  SequenceReader reader(path());
  const std::uint64_t opened = reader.bytesRead();
  expectFrame(reader, 2);
  EXPECT_EQ(reader.bytesRead() - opened, bytesOfFrames(reader, 3, 5));
  const std::uint64_t before = reader.bytesRead();
  expectFrame(reader, 4);
  EXPECT_EQ(reader.bytesRead() - before, bytesOfFrames(reader, 6, 6))
      << "the frame before it was kept";
}

TEST_F(SequenceFile, DecodesEachFrameOnceWhenItIsReadForward) {
  writeChains(path(), kGroups);
  SequenceReader reader(path());
  const std::uint64_t opened = reader.bytesRead();
  for (int pass = 0; pass < 2; ++pass)
    for (const SequenceFrame& frame : reader.frames()) expectFrame(reader, frame.number);
  EXPECT_EQ(reader.bytesRead() - opened, 2 * bytesOfFrames(reader, 0, 7));
}

TEST_F(SequenceFile, IsNoSingleFile) {
  writeSequence(path(), kGroups);
  expectRefused<BadInput>([&] { (void)readEsvr(path()); }, "holds a sequence");
  expectRefused<BadInput>([&] { (void)readEsvrPart(path(), {}); }, "holds a sequence");
  (void)writeEsvr(folder_ / "one.esvr", sampleFrame(1));
  EXPECT_FALSE(holdsSequence(folder_ / "one.esvr"));
  expectRefused<BadInput>([&] { SequenceReader(folder_ / "one.esvr"); }, "holds no sequence");
}

TEST_F(SequenceFile, IsRefusedByReadersOfEarlierVersions) {
  // A reader that does not know a required section refuses the file.
  writeSequence(path(), kGroups);
  const auto table = format::readTable(format::FileSource(path()));
  EXPECT_EQ(table.versionMinor, 3);
  ASSERT_EQ(table.entries.size(), 1u);
  EXPECT_EQ(table.entries.front().flags, format::kRequired);
}

TEST_F(SequenceFile, IsResumedAfterAnyByte) {
  writeSequence(path(), kGroups);
  const auto whole = bytesIn(path());
  const SequenceReader reader(path());
  std::vector<std::size_t> complete(whole.size() + 1);  // number of groups by the number of bytes
  for (std::size_t n = 0; n <= whole.size(); ++n)
    for (const std::size_t lastFrame : {2u, 6u, 7u}) {
      const SequenceFrame& frame = reader.frames()[lastFrame];
      complete[n] += n >= format::alignUp(frame.offset + frame.bytes);
    }
  fs::remove(path());
  {
    SequenceWriter writer(path());
    for (const auto& group : kGroups) append(writer, group), writer.endGroup();
  }
  const auto left = bytesIn(partial());
  // The bytes on both sides of each change of the number of complete groups, and some of the others.
  constexpr std::size_t kStride = 61;
  const auto next = [&](std::size_t n) {
    const std::size_t far = std::min(n + kStride, left.size());
    if (n == far) return n + 1;
    std::size_t last = far;  // before a change
    while (complete[last] != complete[n]) --last;
    return last == n ? n + 1 : last;
  };
  for (std::size_t n = 0; n <= left.size(); n = next(n)) {
    writeBytes(partial(), {left.begin(), left.begin() + std::ptrdiff_t(n)});
    SequenceWriter writer(path(), {.overwrite = true, .partial = PartialSequence::kResume});
    ASSERT_EQ(writer.groupCount(), complete[n]) << n;
    for (std::size_t g = writer.groupCount(); g < kGroups.size(); ++g)
      append(writer, kGroups[g]), writer.endGroup();
    EXPECT_EQ(writer.finish(), whole.size());
    ASSERT_EQ(bytesIn(path()), whole) << n;
  }
}

TEST_F(SequenceFile, IsResumedWhereOnlyItsNameIsMissing) {
  writeSequence(path(), kGroups);
  const auto whole = bytesIn(path());
  fs::rename(path(), partial());
  SequenceWriter writer(path(), {.partial = PartialSequence::kResume});
  EXPECT_EQ(writer.groupCount(), kGroups.size());
  (void)writer.finish();
  EXPECT_EQ(bytesIn(path()), whole);
}

TEST_F(SequenceFile, IsResumedWithTheSameOriginOnly) {
  const auto begin = [&](std::uint64_t origin) {
    return SequenceWriter(path(), {.partial = PartialSequence::kResume, .origin = origin});
  };
  {
    SequenceWriter writer(path(), {.origin = 7});
    append(writer, kGroups[0]);
    writer.endGroup();
  }
  for (const std::uint64_t other : {0, 8})
    EXPECT_THAT([&] { (void)begin(other).groupCount(); },
                test::ThrowsSaying<UsageError>("begun with other options"));
  SequenceWriter writer(path(), {.partial = PartialSequence::kResume, .origin = 7});
  EXPECT_EQ(writer.groupCount(), 1);
}

TEST_F(SequenceFile, DropsGroupsThatAreWrittenAgain) {
  writeSequence(path(), kGroups);
  const auto whole = bytesIn(path());
  fs::rename(path(), partial());
  SequenceWriter writer(path(), {.partial = PartialSequence::kResume});
  writer.dropGroups(1);
  EXPECT_EQ(writer.frames().size(), kGroups[0].size());
  for (std::size_t g = 1; g < kGroups.size(); ++g) append(writer, kGroups[g]), writer.endGroup();
  (void)writer.finish();
  EXPECT_EQ(bytesIn(path()), whole);
}

TEST_F(SequenceFile, IsNotReadBeforeItIsComplete) {
  {
    SequenceWriter writer(path());
    append(writer, kGroups[0]);
    writer.endGroup();
    append(writer, kGroups[1]);
  }
  EXPECT_THAT(folder_.names(), ElementsAre("a.esvr.partial"));
  expectRefused<BadInput>([&] { SequenceReader{partial()}; }, "not complete");
}

TEST_F(SequenceFile, LeavesNothingWithoutAGroup) {
  {
    SequenceWriter writer(path());
    append(writer, kGroups[0]);
    expectRefused<RuntimeFailure>([&] { SequenceWriter again(path()); }, "a.esvr.partial");
  }
  EXPECT_THAT(folder_.names(), IsEmpty());
  SequenceWriter writer(path());
  expectRefused<RuntimeFailure>([&] { (void)writer.finish(); }, "there is no frame");
}

TEST_F(SequenceFile, KeepsAnotherFileThatHasTheNameOfThePartialOne) {
  writeBytes(partial(), bytesOf(std::string(100, 'x')));
  for (const auto start : {PartialSequence::kResume, PartialSequence::kRefuse})
    EXPECT_THROW(SequenceWriter(path(), {.partial = start}), Error);
  EXPECT_EQ(bytesIn(partial()).size(), 100u);
}

TEST_F(SequenceFile, HoldsOneGroupInTheMemoryOfItsWriter) {
  // The writer keeps about 80 bytes for each frame, in vectors that may have twice the capacity and
  // for a moment exist twice. A frame has about 900 bytes.
  constexpr std::size_t kBytesPerFrame = 320;
  constexpr std::int64_t kFrames = 800, kGroupFrames = 8;
  const auto frame = encodeFrame(sampleFrame(1), nullptr);
  ASSERT_GT(frame.size(), 2 * kBytesPerFrame);
  SequenceWriter writer(path());
  const std::size_t before = ::mallinfo2().uordblks;
  for (std::int64_t number = 0; number < kFrames; ++number) {
    writer.append(number, frame);
    if (number % kGroupFrames == kGroupFrames - 1) writer.endGroup();
  }
  EXPECT_LT(::mallinfo2().uordblks, before + kFrames * kBytesPerFrame);
}

TEST_F(SequenceFile, TakesIncreasingNumbersOnly) {
  SequenceWriter writer(path());
  append(writer, {3});
  for (const std::int64_t number : {3, 2})
    expectRefused<UsageError>([&] { append(writer, {number}); }, "is not above 3");
  writer.endGroup();
  expectRefused<UsageError>([&] { append(writer, {-1}); }, "is not above 3");
}

}  // namespace
}  // namespace esvr::test
