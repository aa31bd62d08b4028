// Plan: the bytes of carried grids come back bit for bit, in the heap or in files, in one Blosc
// buffer or in several. Their places put them between the other grids; impossible places, missing
// bytes and damage are refused. Files without carried grids have the version that had none.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>

#include "esvr/container.h"
#include "esvr/error.h"
#include "format/crafted_file.h"
#include "format/sample_files.h"
#include "support/messages.h"
#include "support/temporary_folder.h"

namespace esvr::test {
namespace {

using format::SectionKind;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

/// Two converted grids and two carried ones, one of which is first and one last.
EsvrFile fileOfFour() {
  return {{},
          {fogGrid(3), emptyGrid()},
          {carriedGrid(0, "first"), carriedGrid(3, std::string(5000, 'l'))}};
}

TEST(CarriedGrids, ComeBackBitForBit) { EXPECT_EQ(lossOf(fileOfFour()), ""); }

TEST(CarriedGrids, StandAtTheirPlacesBetweenTheOthers) {
  EsvrFile file = fileOfFour();
  const GridOfFile first{true, 0}, last{true, 1}, fog{false, 0}, empty{false, 1};
  EXPECT_THAT(gridsInOrder(file), ElementsAre(first, fog, empty, last));
  EXPECT_THAT(namesInOrder(file), ElementsAre("velocity", "density", "", "velocity"));
  file.carried[1].place = 2;
  EXPECT_THAT(gridsInOrder(file), ElementsAre(first, fog, last, empty));
  file.grids.clear();
  file.carried[1].place = 1;
  EXPECT_THAT(gridsInOrder(file), ElementsAre(first, last));
}

TEST(CarriedGrids, WithImpossiblePlacesAreNotWritten) {
  for (const std::uint32_t place : {0u, 4u, 0xffffffffu}) {
    EsvrFile file = fileOfFour();
    file.carried[1].place = place;
    EXPECT_THAT(refusalToWrite(file), Says("velocity", std::to_string(place)));
  }
}

TEST(CarriedGrids, WithImpossiblePlacesAreNotRead) {
  CraftedFile crafted(encodeEsvr(fileOfFour()));
  // The place is before the last number of the record.
  const std::size_t at = crafted.content(SectionKind::kCarried).size() - 12;
  crafted.poke(SectionKind::kCarried, at, std::uint32_t{77});
  EXPECT_THAT(refusalToRead(crafted.assemble()), HasSubstr("place 77"));
}

TEST(CarriedGrids, NeedTheirBytes) {
  CraftedFile crafted(encodeEsvr(fileOfFour()));
  crafted.erase(SectionKind::kCarriedBytes);
  EXPECT_THAT(refusalToRead(crafted.assemble()), HasSubstr("there is no carried bytes of grid 2"));
}

TEST(CarriedGrids, BytesWithoutAGridBelongToNothing) {
  CraftedFile crafted(encodeEsvr(fileOfFour()));
  crafted.add({SectionKind::kCarriedBytes, 9}, 0, bytesOf("stray"));
  EXPECT_THAT(refusalToRead(crafted.assemble()), HasSubstr("belongs to nothing"));
}

TEST(CarriedGrids, DamageIsFoundByTheChecksum) {
  auto bytes = encodeEsvr(fileOfFour());
  bytes.back() ^= std::byte{1};  // the file ends with the bytes of the last carried grid
  EXPECT_THAT(refusalToRead(bytes), Says("carried bytes", "checksum"));
}

TEST(CarriedGrids, RaiseTheVersionOfAFileOnlyWhereThereAreAny) {
  const TemporaryFolder folder;
  EsvrFile file = fileOfFour();
  writeEsvr(folder / "new.esvr", file);
  EXPECT_EQ(inspectEsvr(folder / "new.esvr").versionMinor, 1);
  file.carried.clear();
  writeEsvr(folder / "old.esvr", file);
  EXPECT_EQ(inspectEsvr(folder / "old.esvr").versionMinor, 0);
}

TEST(CarriedGrids, WithTheSameBytesShareThem) {
  EsvrFile file = fileOfFour();
  const std::uint64_t two = encodeEsvr(file).size();
  std::string text;
  for (int i = 0; i < 5000; ++i) text += char(i * i % 251);  // hardly compressible
  file.carried = {carriedGrid(0, text), carriedGrid(3, text)};
  EXPECT_LT(encodeEsvr(file).size(), two + text.size() + 100) << "5000 bytes are stored once";
  EXPECT_EQ(lossOf(file), "");
}

class CarriedFile : public testing::Test {
 protected:
  [[nodiscard]] std::filesystem::path path() const { return folder_ / "f.esvr"; }
  TemporaryFolder folder_;
};

TEST_F(CarriedFile, CanBeReadWithoutTheBytes) {
  const EsvrFile file = fileOfFour();
  writeEsvr(path(), file);
  EsvrFile read = readEsvr(path(), {.carriedBytes = false});
  EXPECT_EQ(namesInOrder(read), namesInOrder(file));
  EXPECT_TRUE(read.carried[0].bytes.empty());
  EXPECT_EQ(readEsvrPart(path(), {.layers = 1}).file.carried, read.carried);
  EXPECT_EQ(readEsvrPart(path(), {.carriedBytes = true}).file.carried, file.carried);
  EXPECT_THAT(refusalToWrite(read), HasSubstr("its bytes were not read"));
}

TEST_F(CarriedFile, IsCheckedEvenIfItsBytesAreNotKept) {
  auto bytes = encodeEsvr(fileOfFour());
  bytes.back() ^= std::byte{1};
  writeBytes(path(), bytes);
  EXPECT_THROW((void)readEsvr(path(), {.carriedBytes = false}), BadInput);
  EXPECT_THROW((void)checkEsvr(path()), BadInput);
}

TEST_F(CarriedFile, IsNotedByACheck) {
  writeEsvr(path(), fileOfFour());
  EXPECT_THAT(checkEsvr(path()), testing::Contains(HasSubstr("is carried unchanged")));
}

TEST_F(CarriedFile, LargerThanTheMemoryIsRefusedOrReadIntoAFile) {
  EsvrFile file{{}, {}, {carriedGrid(0, std::string(1'000'000, 'x'))}};
  writeEsvr(path(), file);
  EXPECT_THROW((void)readEsvr(path(), {.maxBytes = 100'000}), MemoryExceeded);
  const VoxelMemory files({.folder = folder_ / ".", .maxHeapBytes = 1000});
  const EsvrFile read = readEsvr(path(), {.maxBytes = 100'000, .memory = files});
  EXPECT_EQ(read.carried, file.carried);
  writeEsvr(folder_ / "again.esvr", read);
  EXPECT_EQ(readEsvr(folder_ / "again.esvr").carried, file.carried);
}

TEST_F(CarriedFile, SlowOfSeveralBloscBuffersComesBack) {
  std::string text(std::size_t{130'000'001}, 'x');  // three buffers of at most 2^26 bytes
  for (std::size_t i = 0; i < text.size(); i += 1000) text[i] = char(i / 1000);
  EsvrFile file{{}, {}, {carriedGrid(0, text)}};
  const std::uint64_t bytes = writeEsvr(path(), file);
  EXPECT_EQ(bytes, std::filesystem::file_size(path()));
  EXPECT_LT(bytes, text.size() / 10);
  EsvrFile read = readEsvr(path());
  ASSERT_EQ(read.carried.front().bytes.size(), text.size());
  // Elements that are compared one by one take seconds without optimisation.
  EXPECT_EQ(std::memcmp(read.carried.front().bytes.data(), text.data(), text.size()), 0);
  read.carried.front().bytes = file.carried.front().bytes = {};
  EXPECT_EQ(read.carried, file.carried);
}

}  // namespace
}  // namespace esvr::test
