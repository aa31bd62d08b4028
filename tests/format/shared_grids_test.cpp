// Plan: voxels that refer to another grid of the file come back bit for bit, for every form of voxels and
// every map of values, and take fewer bytes where the grids are alike. References and packed sections that
// are wrong, and damage to any bit, are refused. A grid is read with the one that it refers to only.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "esvr/container.h"
#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "fit/volumes.h"
#include "format/bytes.h"
#include "format/frame_table.h"
#include "format/sample_files.h"
#include "format/section_writer.h"
#include "format/voxel_sections.h"
#include "support/files.h"
#include "support/messages.h"

namespace esvr::test {
namespace {

using format::SectionKind;
using testing::HasSubstr;
using Bytes = std::vector<std::byte>;

constexpr std::size_t kVersionMinorAt = 10;

/// A ball with soft values, times a gain, plus an offset, which is the background.
SparseVolume ball(float gain, float offset, int bricks = 3) {
  return volumeOf({8, -16, 0}, bricks, offset, [&](Coord v) {
    const double x = v.x - 18.0, y = v.y + 5.0, z = v.z - 12.0;
    const double value = 1.2 - std::sqrt(x * x + y * y + z * z) / 9.0;
    return float(std::max(value, 0.0)) * gain + offset;
  });
}

StoredGrid gridOf(const std::string& name, const SparseVolume& volume, VoxelLayer layer) {
  GridDescriptor descriptor;
  descriptor.name = name;
  return makeStoredVoxels(descriptor, volume, std::move(layer));
}

StoredGrid boundedGrid(const std::string& name, float gain, float offset) {
  const SparseVolume volume = ball(gain, offset);
  return gridOf(name, volume, boundedLayer(volume, 0.01 * std::abs(gain), Activity::kByValue));
}

/// Density, and a temperature that is 40 times the density plus 300.
EsvrFile twoAlike() {
  EsvrFile file{{}, {boundedGrid("density", 1.0f, 0.0f), boundedGrid("heat", 40.0f, 300.0f)}};
  file.grids[1].reference = VoxelReference{0, 40.0f, 300.0f};
  return file;
}

void expectComesBack(const EsvrFile& file) {
  const Bytes bytes = encodeEsvr(file);
  const EsvrFile read = decodeEsvr(bytes, "shared.esvr");
  EXPECT_EQ(difference(read, file), "");
  for (std::size_t g = 0; g < file.grids.size(); ++g)
    EXPECT_EQ(read.grids[g].reference, file.grids[g].reference) << g;
  EXPECT_EQ(encodeEsvr(read), bytes);
}

void decodeLie(const Bytes& bytes) { (void)decodeEsvr(bytes, "lie.esvr"); }

// ---- related voxels

std::vector<VoxelLayer> layersOfAllForms() {
  const SparseVolume volume = ball(1.0f, 0.0f);
  SparseVolume palette = volume, halves = volume;
  for (float& v : palette.values) v = std::floor(v * 32.0f) / 32.0f;
  for (float& v : halves.values) v = std::floor(v * 1024.0f) / 1024.0f;
  return {boundedLayer(volume, 0.01, Activity::kByValue),
          boundedLayer(volume, 0.02, Activity::kExact), exactLayer(palette), exactLayer(halves),
          exactLayer(volume)};
}

TEST(RelatedVoxels, ComeBackInEveryFormAfterEveryForm) {
  const SparseVolume volume = ball(1.0f, 0.0f);
  for (const VoxelLayer& first : layersOfAllForms())
    for (const VoxelLayer& second : layersOfAllForms()) {
      EsvrFile file{{}, {gridOf("a", volume, first), gridOf("b", volume, second)}};
      for (const auto& reference : {VoxelReference{0}, VoxelReference{0, -2.5f, 0.125f},
                                    VoxelReference{0, 3e38f, -3e38f}, VoxelReference{}}) {
        file.grids[1].reference = reference;
        expectComesBack(file);
      }
    }
}

TEST(RelatedVoxels, TakeFewBytesWhereTheMapIsThatOfTheGrids) {
  EsvrFile file = twoAlike();
  const std::uint64_t mapped = bytesAdded(file, 1);
  file.grids[1].reference = VoxelReference{0};
  const std::uint64_t unmapped = bytesAdded(file, 1);
  file.grids[1].reference.reset();
  const std::uint64_t alone = bytesAdded(file, 1);
  EXPECT_EQ(alone, bytesAdded(file.grids[1]));
  EXPECT_LT(3 * mapped, 2 * alone);
  EXPECT_LT(mapped, unmapped);
}

TEST(RelatedVoxels, MayReferToARelatedGrid) {
  EsvrFile file = twoAlike();
  file.grids.push_back(boundedGrid("flame", -7.0f, 1.0f));
  file.grids[2].reference = VoxelReference{1, -7.0f / 40.0f, 53.5f};
  expectComesBack(file);
}

// A constant grid takes a few bytes, and a reader limits the bricks in them.
TEST(RelatedVoxels, OfManyEqualBricksAreReadAgain) {
  const SparseVolume small = ball(1.0f, 0.0f, 1);
  const SparseVolume large = volumeOf({}, 12, 0.0f, [](Coord) { return 5.0f; });
  EsvrFile file{
      {}, {gridOf("small", small, exactLayer(small)), gridOf("large", large, exactLayer(large))}};
  for (const auto& reference : {VoxelReference{0}, VoxelReference{}}) {
    file.grids[1].reference = reference;
    expectComesBack(file);
  }
}

TEST(RelatedVoxels, WhoseReferenceCannotBeFollowedAreNotWritten) {
  for (const std::size_t number : {std::size_t{1}, std::size_t{2}, std::size_t(-1)}) {
    EsvrFile file = twoAlike();
    file.grids[1].reference->grid = number;
    EXPECT_THAT(refusalToWrite(file), Says("heat", "not before it"));
  }
  EsvrFile ellipsoids{{}, {fogGrid(2), boundedGrid("heat", 1.0f, 0.0f)}};
  ellipsoids.grids[1].reference = VoxelReference{0};
  EXPECT_THROW((void)encodeEsvr(ellipsoids), RuntimeFailure);
  ellipsoids.grids[0].reference = VoxelReference{};
  EXPECT_THAT(refusalToWrite(ellipsoids), HasSubstr("a reference, but no voxels"));
}

/// The file of two grids with another beginning of the section of related voxels.
Bytes withReference(std::uint64_t number, float gain, float offset) {
  CraftedFile crafted(encodeEsvr(twoAlike()));
  const Bytes content = crafted.content(SectionKind::kRelated);
  format::ByteWriter out;
  format::putVarint(out, number);
  out.put(gain);
  out.put(offset);
  out.putAll(std::span(content).subspan(1 + 2 * sizeof(float)));
  crafted.setContent(SectionKind::kRelated, out.take());
  return crafted.assemble();
}

TEST(RelatedVoxels, ThatReferToThemselvesOrALaterGridAreNotRead) {
  ASSERT_NO_THROW(decodeLie(withReference(1, 40.0f, 300.0f)));
  for (const std::uint64_t number : {2ull, 3ull, 0x80000000ull})
    EXPECT_THAT(refusalToRead(withReference(number, 1.0f, 0.0f)),
                Says("lie.esvr", "related voxels of grid 1", "which is not before it"))
        << number;
}

TEST(RelatedVoxels, WithAMapThatIsNotFiniteAreNotRead) {
  constexpr float kNotANumber = std::numeric_limits<float>::quiet_NaN();
  for (const auto& map : {std::pair(kNotANumber, 0.0f), std::pair(1.0f, HUGE_VALF)})
    EXPECT_THAT(refusalToRead(withReference(1, map.first, map.second)), HasSubstr("not finite"));
}

TEST(RelatedVoxels, OfAGridWithoutVoxelsAreNotRead) {
  CraftedFile crafted(encodeEsvr(twoAlike()));
  crafted.erase(SectionKind::kVoxels);
  EXPECT_THAT(refusalToRead(crafted.assemble()), HasSubstr("grid 0, which has no voxels"));
}

TEST(RelatedVoxels, BesideOtherVoxelsAreNotRead) {
  CraftedFile crafted(encodeEsvr(twoAlike()));
  crafted.add({SectionKind::kVoxels, 1}, format::kRequired, crafted.content(SectionKind::kVoxels));
  EXPECT_THAT(refusalToRead(crafted.assemble()), HasSubstr("two sets of voxels"));
}

TEST(RelatedVoxels, WithoutAReferenceHaveAHeadOfTheirOwn) {
  CraftedFile crafted(encodeEsvr(twoAlike()));
  crafted.setContent(SectionKind::kRelated, {std::byte{0}, std::byte{1}});
  EXPECT_THAT(refusalToRead(crafted.assemble()), HasSubstr("without a reference"));
}

TEST(RelatedVoxels, CountTowardsTheMemoryThatAReaderMayTake) {
  const Bytes bytes = encodeEsvr(twoAlike());
  const std::uint64_t voxels = twoAlike().grids[0].voxels->codes.size();
  constexpr std::uint64_t kLeastBytesPerVoxel = 8;  // a code and a value
  EXPECT_THROW((void)decodeEsvr(bytes, "f", {kLeastBytesPerVoxel * voxels}), MemoryExceeded);
  EXPECT_NO_THROW((void)decodeEsvr(bytes, "f", {std::uint64_t{64} << 20}));
}

// ---- frames

TEST(RelatedVoxels, ComeBackInAFrameAfterAnother) {
  const EsvrFile first = twoAlike();
  EsvrFile second = twoAlike();
  second.grids[0] = boundedGrid("density", 1.25f, 0.5f);
  const Bytes bytes = encodeFrame(second, &first);
  const EsvrFile read = decodeFrame(bytes, "frame", {}, &first);
  for (std::size_t g = 0; g < 2; ++g) EXPECT_EQ(read.grids[g].voxels, second.grids[g].voxels) << g;
  EXPECT_EQ(encodeFrame(read, &first), bytes);
}

// Some grids are differences from the frame before, and the others have their records in one section.
TEST(RelatedVoxels, OfSeveralGridsComeBackInAFrame) {
  EsvrFile first = twoAlike(), second;
  second.layout = FileLayout::kCompact;
  second.grids = {first.grids[0], first.grids[1], first.grids[1],
                  boundedGrid("flame", -7.0f, 1.0f)};
  first.grids = {first.grids[0], boundedGrid("heat", 3.0f, 2.0f), boundedGrid("heat", 5.0f, 1.0f),
                 boundedGrid("flame", 2.0f, 0.0f)};
  second.grids[3].reference = VoxelReference{1, -7.0f / 40.0f, 53.5f};
  const Bytes bytes = encodeFrame(second, &first);
  const EsvrSummary summary = inspectEsvr(bytes, "frame");
  const auto has = [&](const char* kind) {
    return std::ranges::count(summary.sections, kind, &SectionSummary::kind) > 0;
  };
  EXPECT_TRUE(has("predicted grid") && has("related voxels") && has("grid records"));
  const EsvrFile read = decodeFrame(bytes, "frame", {}, &first);
  for (std::size_t g = 0; g < 4; ++g) EXPECT_EQ(read.grids[g].voxels, second.grids[g].voxels) << g;
  EXPECT_EQ(read.layout, FileLayout::kCompact);
  EXPECT_EQ(encodeFrame(read, &first), bytes);
}

// A reference that is worse than the frame before takes no bytes.
TEST(RelatedVoxels, AreNotUsedInAFrameWhereTheFrameBeforeIsBetter) {
  const EsvrFile first = twoAlike();
  EsvrFile second = twoAlike();
  second.grids[1].reference = VoxelReference{};
  EXPECT_EQ(encodeFrame(second, &first), encodeFrame(twoAlike(), &first));
}

// ---- the compact layout

EsvrFile compact(EsvrFile file) {
  file.layout = FileLayout::kCompact;
  return file;
}

TEST(CompactLayout, BringsBackTheSameContentInFewerBytes) {
  for (const EsvrFile& file :
       {everything(3), twoAlike(), fileOf(layeredGrid(20)), EsvrFile{{}, {levelSetGrid(2)}}}) {
    const Bytes bytes = encodeEsvr(compact(file));
    EXPECT_EQ(difference(decodeEsvr(bytes, "f"), file), "");
    EXPECT_LT(bytes.size(), encodeEsvr(file).size());
    EXPECT_EQ(bytes[kVersionMinorAt], std::byte{4});
    EXPECT_EQ(encodeEsvr(decodeEsvr(bytes, "f")), bytes);
  }
}

TEST(CompactLayout, IsThePlainOneWhereThatIsNotLarger) {
  EXPECT_EQ(encodeEsvr(compact({})), encodeEsvr({}));
  const EsvrFile one = fileOf(emptyGrid());
  EXPECT_EQ(encodeEsvr(compact(one)), encodeEsvr(one));
}

/// Grids that differ in their names.
EsvrFile manyGrids(std::size_t count) {
  EsvrFile file;
  for (std::size_t g = 0; g < count; ++g) {
    file.grids.push_back(fogGrid(1));
    file.grids.back().descriptor.name = "grid " + std::to_string(g);
  }
  return file;
}

// Each of the grids has sections of its own only where they differ, but a record and rows.
TEST(CompactLayout, OfManyGridsTakesFewBytesForEach) {
  constexpr std::size_t kGrids = 500, kBytesEach = 100;
  const EsvrFile file = manyGrids(kGrids);
  const Bytes bytes = encodeEsvr(compact(file));
  EXPECT_LT(bytes.size(), kGrids * kBytesEach);
  EXPECT_EQ(difference(decodeEsvr(bytes, "f"), file), "");
}

// A reader limits the records by the bytes of their section.
TEST(CompactLayout, OfManyEqualRecordsIsReadAgain) {
  EsvrFile file;
  file.grids.assign(3000, emptyGrid());
  EXPECT_EQ(difference(decodeEsvr(encodeEsvr(compact(file)), "f"), file), "");
}

TEST(CompactLayout, KeepsLargeSectionsApart) {
  const EsvrFile file{{}, {fogGrid(2), quantisedGrid(2000)}};
  const Bytes bytes = encodeEsvr(compact(file));
  const auto table = format::readTable(format::MemorySource(bytes, "f"));
  EXPECT_THAT(table.entries,
              testing::Contains(testing::Field(
                  &format::SectionEntry::id,
                  testing::Field(&format::SectionId::kind, SectionKind::kEllipsoids))));
  EXPECT_EQ(table.entries.front().id.kind, SectionKind::kPacked);
  EXPECT_EQ(difference(decodeEsvr(bytes, "f"), file), "");
}

TEST(CompactLayout, IsListedWithTheBytesOfEachSection) {
  const Bytes bytes = encodeEsvr(compact(everything(3)));
  const EsvrSummary summary = inspectEsvr(bytes, "f");
  std::uint64_t sum = 0;
  bool hasRecords = false;
  for (const SectionSummary& section : summary.sections) {
    if (!section.sharedWith) sum += section.storedBytes;
    hasRecords = hasRecords || section.kind == "grid records";
  }
  EXPECT_TRUE(hasRecords);
  EXPECT_EQ(summary.sections.front().kind, "packed sections");
  EXPECT_LT(summary.sections.front().storedBytes, 24 * summary.sections.size());
  EXPECT_LE(sum, summary.fileBytes);
}

TEST(CompactLayout, WithAFlippedBitOrATruncatedEndIsRefused) {
  EsvrFile file = compact(twoAlike());
  file.grids.push_back(quantisedGrid(400));  // a section with a row of its own
  Bytes bytes = encodeEsvr(file);
  ASSERT_FALSE(isRefused(bytes));
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const std::byte bit{std::uint8_t(1u << (i % 8))};
    bytes[i] ^= bit;
    EXPECT_TRUE(isRefused(bytes)) << "byte " << i;
    bytes[i] ^= bit;
  }
  for (std::size_t n = 0; n < bytes.size(); n += 7)
    EXPECT_TRUE(isRefused({bytes.begin(), bytes.begin() + std::ptrdiff_t(n)})) << n;
}

/// The file with other packed sections.
Bytes withPacked(const format::FrameTable& table, const format::FrameContents& contents) {
  CraftedFile crafted(encodeEsvr(compact(twoAlike())));
  crafted.setContent(SectionKind::kPacked, format::putFrame(table, contents));
  return crafted.assemble();
}

TEST(CompactLayout, WithPackedSectionsOfAFrameIsRefused) {
  EXPECT_THAT(refusalToRead(withPacked({{.metadata = true}, {}}, {})),
              Says("lie.esvr", "another frame"));
}

TEST(CompactLayout, WithPackedSectionsWithoutTheMarkOfAFrameIsRefused) {
  Bytes content = format::putFrame({}, {});
  content.front() = std::byte{46};
  const std::uint64_t sum =
      format::checksum(std::span(content).first(content.size() - sizeof(sum)));
  std::memcpy(content.data() + content.size() - sizeof(sum), &sum, sizeof(sum));
  CraftedFile crafted(encodeEsvr(compact(twoAlike())));
  crafted.setContent(SectionKind::kPacked, content);
  EXPECT_THAT(refusalToRead(crafted.assemble()), HasSubstr("no mark of a frame"));
}

TEST(CompactLayout, WithPackedSectionsInPackedSectionsIsRefused) {
  format::FrameTable table;
  table.sections.entries = {{{SectionKind::kPacked}, format::Codec::kRaw, format::kRequired}};
  EXPECT_THAT(refusalToRead(withPacked(table, {{Bytes{}}, {0}})),
              HasSubstr("two sections are packed sections"));
}

TEST(CompactLayout, WithMoreRecordsThanStoredBytesIsRefused) {
  constexpr std::size_t kZeros = 1 << 16;  // records without bytes
  format::SectionWriter out;
  out.add({SectionKind::kGridRecords}, format::kRequired, Bytes(kZeros));
  EXPECT_THAT(refusalToRead(out.assemble()), HasSubstr("more records than it has stored bytes"));
}

// ---- a part of the grids

TEST(ReadPart, OfAGridHasTheGridsThatItRefersTo) {
  TemporaryFolder folder;
  EsvrFile file = twoAlike();
  file.grids.push_back(quantisedGrid(2000));
  file.grids.push_back(boundedGrid("flame", 2.0f, 0.0f));
  for (const auto layout : {FileLayout::kPlain, FileLayout::kCompact}) {
    file.layout = layout;
    const std::string path = folder / "f.esvr";
    const std::uint64_t bytes = writeEsvr(path, file, {.overwrite = true});
    const PartOfFile part = readEsvrPart(path, {.grids = std::vector<std::size_t>{1}});
    ASSERT_EQ(part.file.grids.size(), 4u);
    EXPECT_EQ(part.file.grids[0].voxels, file.grids[0].voxels);
    EXPECT_EQ(part.file.grids[1].voxels, file.grids[1].voxels);
    EXPECT_EQ(part.file.grids[2].field.ellipsoidCount(), 0u);
    EXPECT_EQ(part.file.grids[2].descriptor, file.grids[2].descriptor);
    EXPECT_FALSE(part.file.grids[3].voxels);
    EXPECT_LT(2 * part.bytesRead, bytes);  // the ellipsoids take most of the file
  }
}

TEST(ReadPart, OfNoGridHasTheRecords) {
  TemporaryFolder folder;
  const std::string path = folder / "f.esvr";
  writeEsvr(path, twoAlike());
  const EsvrFile file = readEsvrPart(path, {.grids = std::vector<std::size_t>{}}).file;
  EXPECT_EQ(namesInOrder(file), (std::vector<std::string>{"density", "heat"}));
  EXPECT_FALSE(file.grids[0].voxels || file.grids[1].voxels);
}

TEST(ReadPart, CountsTheEllipsoidsOfGridsThatAreNotRead) {
  const TemporaryFolder folder;
  const std::string path = folder / "f.esvr";
  EsvrFile file = twoAlike();
  file.grids.push_back(quantisedGrid(2000));
  file.grids.push_back(layeredGrid(500));
  const std::uint64_t bytes = writeEsvr(path, file);
  const PartOfFile part = readEsvrPart(path, {.grids = std::vector<std::size_t>{}});
  EXPECT_THAT(part.ellipsoidsInFile,
              testing::ElementsAre(0u, 0u, file.grids[2].field.ellipsoidCount(),
                                   file.grids[3].field.ellipsoidCount()));
  EXPECT_EQ(readEsvrPart(path, {.layers = 1}).ellipsoidsInFile, part.ellipsoidsInFile);
  EXPECT_LT(4 * part.bytesRead, bytes);
}

}  // namespace
}  // namespace esvr::test
