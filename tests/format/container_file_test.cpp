// Plan: files on disk are written completely or not at all, and other kinds of files are refused.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "esvr/container.h"
#include "esvr/error.h"
#include "format/crafted_file.h"
#include "format/sample_files.h"
#include "support/file_size_limit.h"
#include "support/messages.h"
#include "support/temporary_folder.h"

namespace esvr::test {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class ContainerFile : public testing::Test {
 protected:
  [[nodiscard]] fs::path path() const { return folder_ / "f.esvr"; }
  void put(const std::vector<std::byte>& bytes) const { writeBytes(path(), bytes); }
  void put(const std::string& text) const { put(bytesOf(text)); }

  TemporaryFolder folder_;
};

TEST_F(ContainerFile, ComesBackAndHasTheSizeThatWasSaid) {
  const EsvrFile file = everything(100);
  const std::uint64_t written = writeEsvr(path(), file);
  EXPECT_EQ(written, fs::file_size(path()));
  EXPECT_EQ(difference(readEsvr(path()), file), "");
}

TEST_F(ContainerFile, AnExistingOneIsReplacedOnlyWhenAsked) {
  put("precious");
  const EsvrFile file = everything(1);
  EXPECT_THAT([&] { writeEsvr(path(), file); }, ThrowsSaying<RuntimeFailure>("exists already"));
  EXPECT_EQ(fs::file_size(path()), 8u);
  writeEsvr(path(), file, {.overwrite = true});
  EXPECT_EQ(difference(readEsvr(path()), file), "");
}

TEST_F(ContainerFile, AFullDiskLeavesNothing) {
  {
    const FileSizeLimit limit(1000);
    EXPECT_THAT([&] { writeEsvr(path(), everything(100)); },
                ThrowsSaying<RuntimeFailure>("f.esvr"));
  }
  EXPECT_THAT(folder_.names(), IsEmpty());
}

TEST_F(ContainerFile, WhatCannotBeStoredIsNamedAndLeavesNothing) {
  StoredGrid grid = fogGrid(4);
  grid.field.chunks[0].ellipsoids.intensity[2] = std::numeric_limits<float>::infinity();
  EXPECT_THAT([&] { writeEsvr(path(), fileOf(grid)); },
              ThrowsSaying<RuntimeFailure>("'density'", "intensity of ellipsoid 2"));
  EXPECT_THAT(folder_.names(), IsEmpty());
}

TEST_F(ContainerFile, OtherThingsAreRefusedByName) {
  EXPECT_THAT([&] { (void)readEsvr(path()); }, ThrowsSaying<BadInput>("f.esvr: No such file"));
  EXPECT_THAT([&] { (void)readEsvr(folder_.path()); },
              ThrowsSaying<BadInput>("not a regular file"));
  EXPECT_THAT([&] { (void)readEsvr("/dev/zero"); }, ThrowsSaying<BadInput>("not a regular file"));
  put("");
  EXPECT_THAT([&] { (void)readEsvr(path()); }, ThrowsSaying<BadInput>("not an .esvr file"));
  put("a text of more than a few words, but still a text");
  EXPECT_THAT([&] { (void)inspectEsvr(path()); }, ThrowsSaying<BadInput>("not an .esvr file"));
}

TEST_F(ContainerFile, APipeIsRefusedWithoutWaiting) {
  ASSERT_EQ(::mkfifo(path().c_str(), 0600), 0);
  EXPECT_THROW((void)readEsvr(path()), BadInput);
}

TEST_F(ContainerFile, InspectionListsTheSections) {
  writeEsvr(path(), fileOf(chunkedGrid(50)));
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
  CraftedFile crafted(encodeEsvr({}));
  crafted.add({kUnknownKindOfSection}, 0, bytesOf("?"));
  put(crafted.assemble());
  const EsvrSummary summary = inspectEsvr(path());
  ASSERT_EQ(summary.sections.size(), 1u);
  EXPECT_EQ(summary.sections[0].kind, "unknown 0x1234");
  EXPECT_EQ(summary.sections[0].grid, 0xffffffffu);
}

TEST_F(ContainerFile, InspectionDoesNotReadTheSections) {
  CraftedFile crafted(encodeEsvr(everything(10)));
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
  writeEsvr(path(), fileOf(withMap(fogGrid(100), kUniformMapBytes)));
  EXPECT_THAT(checkEsvr(path()), IsEmpty());
}

TEST_F(ContainerFile, CheckRefusesATransformThatIsTooShortOrTooLong) {
  for (const std::size_t bytes : {std::size_t{0}, kUniformMapBytes - 1, kUniformMapBytes + 1}) {
    const fs::path file = path();
    fs::remove(file);
    writeEsvr(file, fileOf(withMap(fogGrid(100), bytes)));
    EXPECT_NO_THROW((void)readEsvr(file)) << "voxels need no transform";
    EXPECT_THAT([&] { (void)checkEsvr(file); },
                ThrowsSaying<BadInput>("not a map of type UniformScaleMap"));
  }
}

TEST_F(ContainerFile, CheckNotesWhatAReaderPassesOver) {
  StoredGrid odd = withMap(emptyGrid(), kUniformMapBytes);
  odd.field.background = 2.0f;
  CraftedFile crafted(encodeEsvr(fileOf(odd)));
  crafted.versionMinor = 7;
  crafted.add({kUnknownKindOfSection, 0}, 0, bytesOf("?"));
  put(crafted.assemble());
  EXPECT_THAT(checkEsvr(path()),
              ElementsAre(HasSubstr("format 1.7"), HasSubstr("unknown 0x1234 of grid 0, 1 bytes"),
                          HasSubstr("no ellipsoids"), HasSubstr("another in its field")));
}

TEST_F(ContainerFile, CheckThrowsForADamagedFile) {
  auto bytes = encodeEsvr(fileOf(fogGrid(100)));
  bytes.back() ^= std::byte{1};
  put(bytes);
  EXPECT_THAT([&] { (void)checkEsvr(path()); }, ThrowsSaying<BadInput>("checksum"));
}

}  // namespace
}  // namespace esvr::test
