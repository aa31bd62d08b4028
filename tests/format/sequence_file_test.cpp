// Plan: small sequences are written, read in any order, and left incomplete at any byte. What a
// reader gets must be what was written, with as few bytes read as the format promises.

#include "esvr/sequence_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <malloc.h>

#include <functional>
#include <numeric>

#include "esvr/error.h"
#include "esvr/frame_coding.h"
#include "format/sample_files.h"
#include "format/section_table.h"
#include "format/sequence_samples.h"
#include "support/temporary_folder.h"

namespace esvr {
namespace {

namespace fs = std::filesystem;
using test::bytesIn;
using test::sampleFrame;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::ThrowsMessage;
using Groups = std::vector<std::vector<std::int64_t>>;

const Groups kGroups{{-7, -6, -3}, {0, 1, 2, 4}, {9}};

class SequenceFile : public testing::Test {
 protected:
  [[nodiscard]] fs::path path() const { return folder_ / "a.esvr"; }
  [[nodiscard]] fs::path partial() const { return SequenceWriter::partialPath(path()); }
  void expectFrame(SequenceReader& reader, std::int64_t number) const {
    EXPECT_EQ(test::difference(reader.read(number), sampleFrame(number)), "") << number;
  }
  void append(SequenceWriter& writer, const std::vector<std::int64_t>& group) const {
    for (const std::int64_t number : group)
      writer.append(number, encodeFrame(sampleFrame(number), nullptr));
  }
  template <class Refused>
  static void expectRefused(const std::function<void()>& action, const char* words) {
    EXPECT_THAT(action, ThrowsMessage<Refused>(HasSubstr(words)));
  }
  test::TemporaryFolder folder_;
};

TEST_F(SequenceFile, GivesItsFramesInAnyOrder) {
  test::writeSequence(path(), kGroups);
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
std::uint64_t bytesOf(const SequenceReader& reader, std::size_t first, std::size_t last) {
  std::uint64_t bytes = 0;
  for (std::size_t i = first; i <= last; ++i) bytes += reader.frames()[i].bytes;
  return bytes;
}

TEST_F(SequenceFile, HasTheBytesOfTheGoldenOne) {
  test::writeGoldenSequence(path());
  EXPECT_EQ(bytesIn(path()), bytesIn(ESVR_GOLDEN_SEQUENCE));
}

TEST_F(SequenceFile, IsOpenedByReadingItsIndexAlone) {
  test::writeSequence(path(), kGroups);
  const SequenceReader reader(path());
  const SequenceFrame& last = reader.frames().back();
  // The magic number is read twice: alone, and with the header.
  EXPECT_LE(reader.bytesRead(), reader.fileBytes() - (last.offset + last.bytes) +
                                    format::kMagic.size() + format::kHeaderBytes);
}

TEST_F(SequenceFile, ReadsAFrameThatRefersToNoneAlone) {
  test::writeSequence(path(), kGroups);
  SequenceReader reader(path());
  const std::uint64_t opened = reader.bytesRead();
  expectFrame(reader, 2);
  EXPECT_EQ(reader.bytesRead() - opened, bytesOf(reader, 5, 5));
}

TEST_F(SequenceFile, ReadsAtMostTheFramesOfAGroupForOneFrame) {
  test::writeChains(path(), kGroups);
  EXPECT_THAT(checkSequence(path()), IsEmpty());
  SequenceReader reader(path());
  const std::uint64_t opened = reader.bytesRead();
  expectFrame(reader, 2);
  EXPECT_EQ(reader.bytesRead() - opened, bytesOf(reader, 3, 5));
  const std::uint64_t before = reader.bytesRead();
  expectFrame(reader, 4);
  EXPECT_EQ(reader.bytesRead() - before, bytesOf(reader, 6, 6)) << "the frame before it was kept";
}

TEST_F(SequenceFile, DecodesEachFrameOnceWhenItIsReadForward) {
  test::writeChains(path(), kGroups);
  SequenceReader reader(path());
  const std::uint64_t opened = reader.bytesRead();
  for (int pass = 0; pass < 2; ++pass)
    for (const SequenceFrame& frame : reader.frames()) expectFrame(reader, frame.number);
  EXPECT_EQ(reader.bytesRead() - opened, 2 * bytesOf(reader, 0, 7));
}

TEST_F(SequenceFile, IsNoSingleFile) {
  test::writeSequence(path(), kGroups);
  expectRefused<BadInput>([&] { (void)readEsvr(path()); }, "holds a sequence");
  expectRefused<BadInput>([&] { (void)readEsvrPart(path(), {}); }, "holds a sequence");
  (void)writeEsvr(folder_ / "one.esvr", sampleFrame(1));
  EXPECT_FALSE(holdsSequence(folder_ / "one.esvr"));
  expectRefused<BadInput>([&] { SequenceReader(folder_ / "one.esvr"); }, "holds no sequence");
}

TEST_F(SequenceFile, IsRefusedByReadersOfEarlierVersions) {
  // A reader that does not know a required section refuses the file.
  test::writeSequence(path(), kGroups);
  const auto table = format::readTable(format::FileSource(path()));
  EXPECT_EQ(table.versionMinor, 3);
  ASSERT_EQ(table.entries.size(), 1u);
  EXPECT_EQ(table.entries.front().flags, format::kRequired);
}

TEST_F(SequenceFile, IsResumedAfterAnyByte) {
  test::writeSequence(path(), kGroups);
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
  for (std::size_t n = 0; n <= left.size(); n += 5) {
    test::writeBytes(partial(), {left.begin(), left.begin() + std::ptrdiff_t(n)});
    SequenceWriter writer(path(), {.overwrite = true, .partial = PartialSequence::kResume});
    ASSERT_EQ(writer.groupCount(), complete[n]) << n;
    for (std::size_t g = writer.groupCount(); g < kGroups.size(); ++g)
      append(writer, kGroups[g]), writer.endGroup();
    EXPECT_EQ(writer.finish(), whole.size());
    ASSERT_EQ(bytesIn(path()), whole) << n;
  }
}

TEST_F(SequenceFile, IsResumedWhereOnlyItsNameIsMissing) {
  test::writeSequence(path(), kGroups);
  const auto whole = bytesIn(path());
  fs::rename(path(), partial());
  SequenceWriter writer(path(), {.partial = PartialSequence::kResume});
  EXPECT_EQ(writer.groupCount(), kGroups.size());
  (void)writer.finish();
  EXPECT_EQ(bytesIn(path()), whole);
}

TEST_F(SequenceFile, DropsGroupsThatAreWrittenAgain) {
  test::writeSequence(path(), kGroups);
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
  test::writeBytes(partial(), test::bytesOf(std::string(100, 'x')));
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
}  // namespace esvr
