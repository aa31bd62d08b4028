// Plan: files on disk are written completely or not at all, and other kinds of files are refused.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>

#include "esvr/container.h"
#include "esvr/error.h"
#include "format/crafted_file.h"
#include "format/sample_files.h"
#include "support/file_size_limit.h"
#include "support/temporary_folder.h"

namespace esvr {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::ThrowsMessage;

class ContainerFile : public testing::Test {
 protected:
  [[nodiscard]] fs::path path() const { return folder_ / "f.esvr"; }
  void put(const std::vector<std::byte>& bytes) const {
    std::ofstream out(path(), std::ios::binary);
    out.write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
  }
  void put(const std::string& text) const { put(test::bytesOf(text)); }

  test::TemporaryFolder folder_;
};

TEST_F(ContainerFile, ComesBackAndHasTheSizeThatWasSaid) {
  const EsvrFile file = test::everything(100);
  const std::uint64_t written = writeEsvr(path(), file);
  EXPECT_EQ(written, fs::file_size(path()));
  EXPECT_EQ(test::difference(readEsvr(path()), file), "");
}

TEST_F(ContainerFile, AnExistingOneIsReplacedOnlyWhenAsked) {
  put("precious");
  const EsvrFile file = test::everything(1);
  EXPECT_THAT([&] { writeEsvr(path(), file); },
              ThrowsMessage<RuntimeFailure>(HasSubstr("exists already")));
  EXPECT_EQ(fs::file_size(path()), 8u);
  writeEsvr(path(), file, {.overwrite = true});
  EXPECT_EQ(test::difference(readEsvr(path()), file), "");
}

TEST_F(ContainerFile, AFullDiskLeavesNothing) {
  {
    const test::FileSizeLimit limit(1000);
    EXPECT_THAT([&] { writeEsvr(path(), test::everything(100)); },
                ThrowsMessage<RuntimeFailure>(HasSubstr("f.esvr")));
  }
  EXPECT_THAT(folder_.names(), IsEmpty());
}

TEST_F(ContainerFile, WhatCannotBeStoredIsNamedAndLeavesNothing) {
  StoredGrid grid = test::fogGrid(4);
  grid.field.chunks[0].ellipsoids.intensity[2] = std::numeric_limits<float>::infinity();
  EXPECT_THAT([&] { writeEsvr(path(), test::fileOf(grid)); },
              ThrowsMessage<RuntimeFailure>(
                  AllOf(HasSubstr("'density'"), HasSubstr("intensity of ellipsoid 2"))));
  EXPECT_THAT(folder_.names(), IsEmpty());
}

TEST_F(ContainerFile, OtherThingsAreRefusedByName) {
  EXPECT_THAT([&] { (void)readEsvr(path()); },
              ThrowsMessage<BadInput>(HasSubstr("f.esvr: No such file")));
  EXPECT_THAT([&] { (void)readEsvr(folder_.path()); },
              ThrowsMessage<BadInput>(HasSubstr("not a regular file")));
  EXPECT_THAT([&] { (void)readEsvr("/dev/zero"); },
              ThrowsMessage<BadInput>(HasSubstr("not a regular file")));
  put("");
  EXPECT_THAT([&] { (void)readEsvr(path()); },
              ThrowsMessage<BadInput>(HasSubstr("not an .esvr file")));
  put("a text of more than a few words, but still a text");
  EXPECT_THAT([&] { (void)inspectEsvr(path()); },
              ThrowsMessage<BadInput>(HasSubstr("not an .esvr file")));
}

TEST_F(ContainerFile, APipeIsRefusedWithoutWaiting) {
  ASSERT_EQ(::mkfifo(path().c_str(), 0600), 0);
  EXPECT_THROW((void)readEsvr(path()), BadInput);
}

TEST_F(ContainerFile, InspectionListsTheSections) {
  writeEsvr(path(), test::fileOf(test::chunkedGrid(50)));
  const EsvrSummary summary = inspectEsvr(path());
  EXPECT_EQ(summary.versionMajor, kFormatVersion);
  EXPECT_EQ(summary.fileBytes, fs::file_size(path()));
  std::vector<std::string> kinds;
  for (const auto& s : summary.sections) kinds.push_back(s.kind);
  // The first chunk has no rotations, and the second one has no ellipsoids.
  EXPECT_THAT(kinds, ElementsAre("grid", "chunks", "centers", "scales", "intensities", "centers",
                                 "scales", "rotations", "intensities", "kappas"));
  EXPECT_EQ(summary.sections[2].rawBytes, 50u * 3 * sizeof(float));
}

constexpr auto kUnknownKindOfSection = format::SectionKind(0x1234);

TEST_F(ContainerFile, InspectionNamesWhatItDoesNotKnow) {
  test::CraftedFile crafted(encodeEsvr({}));
  crafted.add({kUnknownKindOfSection}, 0, test::bytesOf("?"));
  put(crafted.assemble());
  const EsvrSummary summary = inspectEsvr(path());
  ASSERT_EQ(summary.sections.size(), 1u);
  EXPECT_EQ(summary.sections[0].kind, "unknown 0x1234");
  EXPECT_EQ(summary.sections[0].grid, 0xffffffffu);
}

TEST_F(ContainerFile, InspectionDoesNotReadTheSections) {
  test::CraftedFile crafted(encodeEsvr(test::everything(10)));
  auto bytes = crafted.assemble();
  bytes.back() ^= std::byte{1};
  put(bytes);
  EXPECT_EQ(inspectEsvr(path()).fileBytes, bytes.size());
  EXPECT_THROW((void)readEsvr(path()), BadInput);
}

constexpr std::size_t kUniformMapBytes = 15 * sizeof(double);  // five vectors

StoredGrid withMap(StoredGrid grid, std::size_t bytes) {
  grid.descriptor.transform.mapType = "UniformScaleMap";
  grid.descriptor.transform.map.assign(bytes, std::byte{});
  return grid;
}

TEST_F(ContainerFile, CheckHasNothingToSayOfAGoodFile) {
  writeEsvr(path(), test::fileOf(withMap(test::fogGrid(100), kUniformMapBytes)));
  EXPECT_THAT(checkEsvr(path()), IsEmpty());
}

TEST_F(ContainerFile, CheckRefusesATransformThatIsTooShortOrTooLong) {
  for (const std::size_t bytes : {std::size_t{0}, kUniformMapBytes - 1, kUniformMapBytes + 1}) {
    const fs::path file = path();
    fs::remove(file);
    writeEsvr(file, test::fileOf(withMap(test::fogGrid(100), bytes)));
    EXPECT_NO_THROW((void)readEsvr(file)) << "voxels need no transform";
    EXPECT_THAT([&] { (void)checkEsvr(file); },
                ThrowsMessage<BadInput>(HasSubstr("not a map of type UniformScaleMap")));
  }
}

TEST_F(ContainerFile, CheckNotesWhatAReaderPassesOver) {
  StoredGrid odd = withMap(test::emptyGrid(), kUniformMapBytes);
  odd.field.background = 2.0f;
  test::CraftedFile crafted(encodeEsvr(test::fileOf(odd)));
  crafted.versionMinor = 7;
  crafted.add({kUnknownKindOfSection, 0}, 0, test::bytesOf("?"));
  put(crafted.assemble());
  EXPECT_THAT(checkEsvr(path()),
              ElementsAre(HasSubstr("format 1.7"), HasSubstr("unknown 0x1234 of grid 0, 1 bytes"),
                          HasSubstr("no ellipsoids"), HasSubstr("another in its field")));
}

TEST_F(ContainerFile, CheckThrowsForADamagedFile) {
  auto bytes = encodeEsvr(test::fileOf(test::fogGrid(100)));
  bytes.back() ^= std::byte{1};
  put(bytes);
  EXPECT_THAT([&] { (void)checkEsvr(path()); }, ThrowsMessage<BadInput>(HasSubstr("checksum")));
}

}  // namespace
}  // namespace esvr
