// Plan: sections that are stored alike share their bytes, and no others do. Grids that differ in
// their descriptors only add a record and rows to the file; each of them comes back with its own
// descriptor. Tables whose rows overlap in any other way are refused, and damage to shared bytes is
// reported.
//
// Integers of every length and content of every codec come back, in as many bytes as they should
// take. Sizes and codecs that cannot be are refused before memory is allocated.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <filesystem>
#include <functional>
#include <random>

#include "esvr/container.h"
#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "fit/volumes.h"
#include "format/bytes.h"
#include "format/sample_files.h"
#include "format/section_table.h"
#include "format/section_writer.h"
#include "support/files.h"
#include "support/messages.h"

namespace esvr::test {
namespace {

using format::SectionEntry;
using format::SectionKind;
using format::SectionTable;
using format::SectionWriter;
using testing::HasSubstr;
using Bytes = std::vector<std::byte>;

constexpr auto kLaterKind = SectionKind(0x1234);

SectionTable tableOf(const Bytes& bytes) {
  return format::readTable(format::MemorySource(bytes, "twins.esvr"));
}

Bytes content() { return bytesOf("content of a section"); }

/// A file of two sections of kinds that no reader knows.
Bytes fileOfTwo(const format::SectionId& a, const format::SectionId& b, const Bytes& contentOfB) {
  SectionWriter out;
  out.addRaw(a, 0, content());
  out.addRaw(b, 0, contentOfB);
  return out.assemble();
}

bool areShared(const Bytes& file) {
  const auto entries = tableOf(file).entries;
  return entries[0].offset == entries[1].offset;
}

TEST(SectionWriter, StoresEqualSectionsOnce) {
  const Bytes file = fileOfTwo({kLaterKind, 0}, {kLaterKind, 1}, content());
  EXPECT_TRUE(areShared(file));
  EXPECT_EQ(file.size(), format::kHeaderBytes + 2 * format::kEntryBytes + content().size());
  EXPECT_TRUE(decodeEsvr(file, "twins.esvr").grids.empty());
}

TEST(SectionWriter, StoresSectionsOfTwoKindsApart) {
  EXPECT_FALSE(areShared(fileOfTwo({kLaterKind}, {SectionKind(0x1235)}, content())));
}

TEST(SectionWriter, StoresSectionsThatDifferInABitApart) {
  Bytes other = content();
  other.back() ^= std::byte{1};
  EXPECT_FALSE(areShared(fileOfTwo({kLaterKind, 0}, {kLaterKind, 1}, other)));
}

StoredGrid voxelGrid(float background) {
  const SparseVolume volume = fullBricks({{0, 0, 0}, {0, 0, 8}}, background, [](Coord at) {
    const int v = voxelOffset(localOf(at));
    return float(v * v % 997) * 0.125f;
  });
  return makeStoredVoxels({}, volume, exactLayer(volume));
}

TEST(SectionWriter, TellsVoxelsWithZeroFromThoseWithMinusZero) {
  const EsvrFile file{{}, {voxelGrid(0.0f), voxelGrid(-0.0f)}};
  const EsvrFile back = decodeEsvr(encodeEsvr(file), "zeros.esvr");
  EXPECT_FALSE(std::signbit(back.grids[0].voxels->background));
  EXPECT_TRUE(std::signbit(back.grids[1].voxels->background));
}

// ---- grids with the same data

StoredGrid twinOf(StoredGrid grid) {
  grid.descriptor.name = "twin";
  grid.descriptor.transform.mapType = "AffineMap";
  grid.descriptor.metadata.push_back({"note", "string", bytesOf("of the twin")});
  return grid;
}
EsvrFile withTwin(const StoredGrid& grid) { return {{}, {grid, twinOf(grid)}}; }

struct Sample {
  const char* name;
  StoredGrid grid;
};
void PrintTo(const Sample& sample, std::ostream* out) { *out << sample.name; }

class GridWithATwin : public testing::TestWithParam<Sample> {};

TEST_P(GridWithATwin, AddsItsRecordAndRowsOnly) {
  const StoredGrid& grid = GetParam().grid;
  const std::size_t alone = encodeEsvr(fileOf(grid)).size();
  const Bytes both = encodeEsvr(withTwin(grid));
  const auto entries = tableOf(both).entries;
  const std::size_t rows = entries.size() / 2;
  ASSERT_EQ(entries[1].id, (format::SectionId{SectionKind::kGrid, 1}));
  const std::size_t added = rows * format::kEntryBytes + format::alignUp(entries[1].storedBytes);
  EXPECT_EQ(format::alignUp(both.size()), format::alignUp(alone) + added);
  EXPECT_EQ(bytesAddedTogether(withTwin(grid).grids), bytesAdded(grid) + added);
}

TEST_P(GridWithATwin, ComesBackWithBothDescriptors) {
  EXPECT_EQ(lossOf(withTwin(GetParam().grid)), "");
}

INSTANTIATE_TEST_SUITE_P(All, GridWithATwin,
                         testing::Values(Sample{"planes", fogGrid(200)},
                                         Sample{"bricks", levelSetGrid(20)},
                                         Sample{"chunks", chunkedGrid(30)},
                                         Sample{"quantised", quantisedGrid(100)},
                                         Sample{"layered", layeredGrid(100)},
                                         Sample{"residual", corrected(quantisedGrid(20))},
                                         Sample{"voxels", voxelGrid(0.0f)}));

TEST(GridsWithTheSameData, HaveTheirPartsRead) {
  const TemporaryFolder folder;
  const StoredGrid grid = layeredGrid(9000);
  writeEsvr(folder / "twins.esvr", withTwin(grid));
  writeEsvr(folder / "one.esvr", fileOf(grid));
  const auto part = readEsvrPart(folder / "twins.esvr", {.layers = 1});
  const auto one = readEsvrPart(folder / "one.esvr", {.layers = 1}).file.grids[0];
  EXPECT_EQ(difference(part.file, withTwin(one)), "");
  EXPECT_LT(part.bytesRead, std::filesystem::file_size(folder / "twins.esvr"));
}

TEST(GridsWithTheSameData, AreListedWithTheSectionsThatTheyShare) {
  const TemporaryFolder folder;
  writeEsvr(folder / "twins.esvr", withTwin(voxelGrid(0.0f)));
  const auto sections = inspectEsvr(folder / "twins.esvr").sections;
  ASSERT_EQ(sections.size(), 4u);  // the records of both grids come first
  EXPECT_EQ(sections[1].sharedWith, std::nullopt);
  EXPECT_EQ(sections[2].sharedWith, std::nullopt);
  EXPECT_EQ(sections[3].kind, "voxels");
  EXPECT_EQ(sections[3].grid, 1u);
  EXPECT_EQ(sections[3].sharedWith, 2u);
}

TEST(GridsWithTheSameData, CountForEachGridWhereMemoryIsLimited) {
  const TemporaryFolder folder;
  const StoredGrid grid = fogGrid(1000);
  constexpr std::uint64_t kEnoughForOne = 300'000;  // about 44 bytes * 4 * 1000 for a grid
  writeEsvr(folder / "one.esvr", fileOf(grid));
  writeEsvr(folder / "twins.esvr", withTwin(grid));
  EXPECT_EQ(readEsvr(folder / "one.esvr", {kEnoughForOne}).grids.size(), 1u);
  EXPECT_THROW((void)readEsvr(folder / "twins.esvr", {kEnoughForOne}), MemoryExceeded);
}

// ---- damaged and hostile files

TEST(SharedBytes, AreReportedWhereTheyAreDamaged) {
  Bytes file = encodeEsvr(withTwin(voxelGrid(0.0f)));
  file.back() ^= std::byte{1};
  EXPECT_THAT(refusalToRead(file), HasSubstr("lie.esvr: section 2 (voxels of grid 0, at byte"));
}

TEST(SharedBytes, OfKindsThatNoReaderKnowsAreCheckedToo) {
  Bytes file = fileOfTwo({kLaterKind, 0}, {kLaterKind, 1}, content());
  file.back() ^= std::byte{1};
  EXPECT_THAT(refusalToRead(file), HasSubstr("checksum"));
}

/// The file with another table of the same size.
Bytes withTable(Bytes file, const SectionTable& table) {
  const Bytes head = format::encodeTable(table);
  std::copy(head.begin(), head.end(), file.begin());
  return file;
}

void expectOverlap(const Bytes& file) {
  EXPECT_THAT(refusalToRead(file), HasSubstr("lie.esvr: sections overlap at byte"));
}

/// A change to the row of the second section, which shares its bytes with the first one.
struct RowLie {
  const char* name;
  std::function<void(SectionEntry&)> tell;
};
void PrintTo(const RowLie& lie, std::ostream* out) { *out << lie.name; }

class RowLies : public testing::TestWithParam<RowLie> {};

TEST_P(RowLies, AreRefusedAsOverlaps) {
  const Bytes file = fileOfTwo({kLaterKind, 0}, {kLaterKind, 1}, content());
  SectionTable table = tableOf(file);
  GetParam().tell(table.entries[1]);
  expectOverlap(withTable(file, table));
}

INSTANTIATE_TEST_SUITE_P(
    All, RowLies,
    testing::Values(RowLie{"shorter", [](auto& e) { e.storedBytes = e.rawBytes -= 8; }},
                    RowLie{"begins later", [](auto& e) { e.offset += 8, e.storedBytes -= 8; }},
                    RowLie{"of another kind", [](auto& e) { e.id.kind = SectionKind(0x1235); }},
                    RowLie{"of another codec", [](auto& e) { e.codec = format::Codec::kBlosc; }},
                    RowLie{"of other flags", [](auto& e) { e.flags = 4; }},
                    RowLie{"of another raw size", [](auto& e) { e.rawBytes += 1; }},
                    RowLie{"of another checksum", [](auto& e) { e.checksum += 1; }}));

TEST(SharedBytes, AreNotThoseOfTheHeaderOrTheTable) {
  const Bytes file = fileOfTwo({kLaterKind, 0}, {kLaterKind, 1}, content());
  const SectionTable good = tableOf(file);
  for (const bool ofHeader : {true, false}) {
    SectionTable table = good;
    for (SectionEntry& e : table.entries) {
      e.offset = ofHeader ? 0 : table.tableOffset;
      e.storedBytes = ofHeader ? format::kHeaderBytes : 2 * format::kEntryBytes;
    }
    expectOverlap(withTable(file, table));
  }
}

}  // namespace
}  // namespace esvr::test

namespace esvr::format {
namespace {

// Bytes.

TEST(Varint, ComesBackInTheFewestBytes) {
  for (int bits = 0; bits <= 64; ++bits)
    for (const std::uint64_t less : {0u, 1u}) {
      const std::uint64_t value = (bits == 64 ? 0 : std::uint64_t{1} << bits) - less;
      ByteWriter out;
      putVarint(out, value);
      EXPECT_EQ(int(out.size()), std::max((int(std::bit_width(value)) + 6) / 7, 1)) << value;
      ByteReader in(out.bytes(), "test");
      EXPECT_EQ(getVarint(in), value);
      EXPECT_EQ(in.left(), 0u);
    }
}

TEST(Varint, RefusesTooManyBitsAndTruncation) {
  const auto read = [](std::span<const std::uint8_t> bytes) {
    ByteReader in(std::as_bytes(bytes), "test");
    return getVarint(in);
  };
  std::array<std::uint8_t, 10> bytes;
  bytes.fill(0xff);
  bytes.back() = 1;
  EXPECT_EQ(read(bytes), ~std::uint64_t{0});
  bytes.back() = 2;
  EXPECT_THROW((void)read(bytes), BadInput);
  bytes.back() = 0x81;
  EXPECT_THROW((void)read(bytes), BadInput);
  EXPECT_THROW((void)read(std::span(bytes).first(3)), BadInput);
}

// The table.

using Bytes = std::vector<std::byte>;

Bytes floats(std::size_t count) {
  std::mt19937 random(3);
  std::vector<float> values(count);
  for (float& value : values) value = 0.5f + 2.0f * float(random()) / 4294967296.0f;
  const auto bytes = std::as_bytes(std::span(values));
  return {bytes.begin(), bytes.end()};
}

Bytes contentOf(const Packed& packed) {
  EXPECT_TRUE(plausibleSizes(packed.codec, packed.bytes.size(), packed.rawBytes));
  return unpack(packed.codec, packed.bytes, packed.rawBytes, "x");
}

TEST(Codec, BringsContentBack) {
  for (const Bytes& content : {Bytes{}, Bytes(1), Bytes(3'000'000), floats(1), floats(500)}) {
    EXPECT_EQ(contentOf(pack(content)), content);
    if (content.size() % 4 == 0) {
      EXPECT_EQ(contentOf(packFloats(content)), content);
    }
  }
}

TEST(Codec, StoresRawWhereCompressionSavesNothing) {
  EXPECT_EQ(pack(Bytes(8)).codec, Codec::kRaw);
  EXPECT_EQ(pack(Bytes(80)).codec, Codec::kBytes);
  EXPECT_EQ(packFloats(floats(4)).codec, Codec::kRaw);
}

TEST(Codec, StoresTheLowBytesOfFloatsAsTheyAre) {
  const Bytes content = floats(1000);
  const Packed packed = packFloats(content);
  EXPECT_EQ(packed.codec, Codec::kFloats);
  EXPECT_LT(packed.bytes.size(), 3200u);
  EXPECT_EQ(Bytes(packed.bytes.begin() + 3, packed.bytes.begin() + 6),
            Bytes(content.begin() + 4, content.begin() + 7));
  EXPECT_LT(packed.bytes.size(), pack(content).bytes.size());
}

TEST(Codec, StoresFloatsOfFewDigitsAsBytes) {
  std::vector<float> values;
  for (int i = 0; i < 500; ++i) values.push_back(float(i % 37) * 0.25f);
  const auto bytes = std::as_bytes(std::span(values));
  const Packed packed = packFloats({bytes.begin(), bytes.end()});
  EXPECT_EQ(packed.codec, Codec::kBytes);
  EXPECT_LT(packed.bytes.size(), 400u);
}

TEST(Codec, KnowsSizesThatCannotBe) {
  EXPECT_FALSE(plausibleSizes(Codec::kRaw, 7, 8));
  EXPECT_TRUE(plausibleSizes(Codec::kBytes, 0, 1023));
  EXPECT_FALSE(plausibleSizes(Codec::kBytes, 0, 1024));
  EXPECT_TRUE(plausibleSizes(Codec::kFloats, 6, 8));
  EXPECT_FALSE(plausibleSizes(Codec::kFloats, 5, 8));
  EXPECT_FALSE(plausibleSizes(Codec::kFloats, 8, 7));
  EXPECT_FALSE(plausibleSizes(Codec::kBlosc, 0, 16384));
}

TEST(Codec, LeavesBloscToCarriedGrids) {
  EXPECT_THAT([] { (void)unpack(Codec::kBlosc, Bytes(100), 100, "place"); },
              test::ThrowsSaying<BadInput>("place: Blosc"));
}

}  // namespace
}  // namespace esvr::format
