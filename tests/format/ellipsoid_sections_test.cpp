// Plan: quantised chunks, all at once or in importance layers, are decoded integer by integer. A part of a file has the
// same ellipsoids as that part of the whole file, and takes fewer bytes to read. Wrong sections are detected before memory
// is allocated for them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>

#include "esvr/container.h"
#include "esvr/encode.h"
#include "esvr/error.h"
#include "esvr/field.h"
#include "esvr/grid_coding.h"
#include "fit/volumes.h"
#include "format/bytes.h"
#include "format/sample_files.h"
#include "support/files.h"
#include "support/machine.h"

namespace esvr::test {
namespace {

using format::SectionKind;
using testing::HasSubstr;

constexpr std::size_t kMebibyte = 1 << 20;

EsvrFile quantisedFile(std::size_t n) { return fileOf(quantisedGrid(n)); }

TEST(QuantisedFile, ComesBackIntegerByInteger) {
  for (const std::size_t n : {1u, 7u, 4096u, 4097u, 9000u})
    EXPECT_EQ(lossOf(quantisedFile(n)), "") << n;
}

TEST(QuantisedFile, TakesLessThanHalfOfTheBytesOfTheFloats) {
  EsvrFile file = quantisedFile(4000);
  const auto compact = encodeEsvr(file).size();
  file.grids[0].quantised.clear();
  EXPECT_LT(2 * compact, encodeEsvr(file).size());
}

TEST(QuantisedFile, SaysWhereItsBytesAre) {
  const EsvrFile file = quantisedFile(4000);
  const StreamBytes bytes = streamBytes(file.grids[0]);
  const auto total = bytes.positions + bytes.scales + bytes.rotations + bytes.intensities;
  EXPECT_GT(total, 4000u);
  EXPECT_NEAR(double(total), double(encodeEsvr(file).size()), 800.0);  // header, tables, records
}

TEST(QuantisedFile, IsRefusedWhereItsFieldIsAnother) {
  EsvrFile file = quantisedFile(3);
  file.grids[0].field.chunks[1].ellipsoids.intensity[2] *= 2.0f;
  EXPECT_THAT(refusalToWrite(file), HasSubstr("not what is quantised (chunk 1)"));
}

TEST(QuantisedFile, ManyAlikeArePaddedToWhatAReaderBelieves) {
  EsvrFile file = quantisedFile(1);
  auto& grid = file.grids[0];
  grid.field.chunks.resize(1);
  grid.quantised.resize(1);
  QuantisedEllipsoids& q = grid.quantised[0];
  const auto repeat = [](auto& values) {
    const auto first = values[0];
    values.assign(200'000, first);
  };
  for (auto& v : q.position) repeat(v);
  for (auto& v : q.scale) repeat(v);
  for (auto& v : q.rotation) repeat(v);
  repeat(q.precision);
  repeat(q.intensity);
  grid.field.chunks[0].ellipsoids = dequantise(q);
  EXPECT_EQ(lossOf(file), "");
}

/// Offsets in the section (docs/format.md, "Quantised ellipsoids").
namespace quantised_at {
constexpr std::size_t kCount = 0, kCell = 8, kScaleStep = 28, kIntensityStep = 40,
                      kPositionBase = 48, kCellBits = 72, kSigns = 73, kThresholds = 74;
}  // namespace quantised_at
/// Offset of the number of ellipsoids in a chunk record.
constexpr std::size_t kCountInChunk = 36;

template <class T>
void expectQuantisedLie(std::size_t offset, T value, const char* answer) {
  CraftedFile file(encodeEsvr(quantisedFile(5)));
  file.poke(SectionKind::kEllipsoids, offset, value);
  EXPECT_THAT(refusalToRead(file.assemble()), HasSubstr(answer));
}

TEST(QuantisedLies, AreFoundOut) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  expectQuantisedLie(quantised_at::kCount, std::uint64_t{6}, "with 6 ellipsoids for 5");
  expectQuantisedLie(quantised_at::kCell, 0.0, "the cell of the lattice");
  expectQuantisedLie(quantised_at::kCell, nan, "the cell of the lattice");
  expectQuantisedLie(quantised_at::kScaleStep, -1.0, "the step of scales");
  expectQuantisedLie(quantised_at::kScaleStep, 1e300, "finite");
  expectQuantisedLie(quantised_at::kIntensityStep, HUGE_VAL, "the step of intensities");
  expectQuantisedLie(quantised_at::kPositionBase, 1 << 30, "the base of positions");
  expectQuantisedLie(quantised_at::kCellBits, std::uint8_t{21}, "too many cells");
  expectQuantisedLie(quantised_at::kSigns, std::uint8_t{2}, "mark of signs");
  expectQuantisedLie(quantised_at::kThresholds, std::uint8_t{255}, "lie.esvr");
}

TEST(QuantisedLies, AMissingSectionIsNamed) {
  CraftedFile file(encodeEsvr(quantisedFile(5)));
  file.erase(SectionKind::kEllipsoids);
  EXPECT_THAT(refusalToRead(file.assemble()),
              HasSubstr("there is no ellipsoids of grid 0, chunk 0"));
}

TEST(QuantisedLies, FloatsBesideThemBelongToNothing) {
  CraftedFile file(encodeEsvr(quantisedFile(5)));
  file.add({SectionKind::kCenters, 0, 0}, format::kRequired, std::vector<std::byte>(60));
  EXPECT_THAT(refusalToRead(file.assemble()), HasSubstr("belongs to nothing"));
}

TEST(QuantisedLies, AKilobyteCannotAskForAGigabyte) {
  for (std::uint64_t count = std::uint64_t{1} << 62; count > 5; count /= 2) {
    CraftedFile file(encodeEsvr(quantisedFile(5)));
    file.poke(SectionKind::kChunks, kCountInChunk, count);
    EXPECT_THROW((void)decodeEsvr(file.assemble(), "lie"), BadInput) << count;
    file.poke(SectionKind::kEllipsoids, quantised_at::kCount, count);
    const auto bytes = file.assemble();
    ASSERT_LT(bytes.size(), 2048u);
    const AllocationMeter meter;
    try {  // a few more than there are may be read, from zeros behind the streams
      (void)decodeEsvr(bytes, "lie");
    } catch (const BadInput&) {
    }
    EXPECT_LT(meter.bytes(), 32 * kMebibyte) << count;
  }
}

TEST(QuantisedLies, AnyBytesOfAStreamAreReadOrRefused) {
  const auto whole = encodeEsvr(quantisedFile(40));
  std::uint32_t state = 7;
  for (int n = 0; n < trials(3000); ++n) {
    CraftedFile file(whole);
    auto& stored = file.section(SectionKind::kEllipsoids).stored;
    for (int k = 0; k < 4; ++k) {
      state = state * 1664525u + 1013904223u;
      stored[(state >> 8) % stored.size()] = std::byte(state >> 24);
    }
    try {
      const auto once = encodeEsvr(decodeEsvr(file.assemble(), "any"));
      EXPECT_EQ(encodeEsvr(decodeEsvr(once, "again")), once);
    } catch (const BadInput&) {
    }
  }
}

// ---- Importance layers

EsvrFile layeredFile(std::size_t n) { return fileOf(layeredGrid(n)); }

TEST(LayeredFile, ComesBackIntegerByInteger) {
  for (const std::size_t n : {2u, 7u, 4097u, 20000u}) {
    const EsvrFile file = layeredFile(n);
    ASSERT_GE(layerCount(file.grids[0]), 2u);
    EXPECT_EQ(lossOf(file), "") << n;
  }
}

TEST(LayeredFile, HasTheHeavierEllipsoidsInTheFirstLayers) {
  const StoredGrid grid = layeredGrid(500);
  const QuantisedEllipsoids& q = grid.quantised[1];
  std::size_t first = 0;
  int before = Lattice::kMaxPrecision + 1;
  for (const std::size_t end : q.layerEnds) {
    const auto [low, high] = std::minmax_element(q.precision.begin() + std::ptrdiff_t(first),
                                                 q.precision.begin() + std::ptrdiff_t(end));
    EXPECT_LT(int(*high), before);
    before = *low;
    first = end;
  }
  EXPECT_EQ(first, q.size());
}

/// Layers are meant for 20,000 ellipsoids. These are spread evenly and are all similar, so that the
/// cost of layers is not hidden by what they save.
TEST(LayeredFile, CostsLittleMoreThanOneWithoutLayers) {
  StoredGrid one = quantisedGrid(20000), layered = layeredGrid(20000);
  layered.layerErrors.clear();
  const double without = double(encodeEsvr(fileOf(one)).size());
  EXPECT_LT(double(encodeEsvr(fileOf(layered)).size()), 1.02 * without);
}

TEST(LayeredFile, SaysWhatEachLayerAdds) {
  const StoredGrid grid = layeredGrid(300);
  const auto sizes = layerSizes(grid);
  ASSERT_EQ(sizes.size(), layerCount(grid));
  std::uint64_t ellipsoids = 0, bytes = 0;
  for (const LayerSize& size : sizes) ellipsoids += size.ellipsoids, bytes += size.bytes;
  EXPECT_EQ(ellipsoids, 600u);
  const StreamBytes streams = streamBytes(grid);
  EXPECT_EQ(bytes, streams.positions + streams.scales + streams.rotations + streams.intensities);
}

TEST(LayeredFile, IsRefusedWhereItsLayersDoNotDivideIt) {
  for (const auto& ends : {std::vector<std::size_t>{5}, {0, 20}, {3, 3, 20}, {3, 19}}) {
    EsvrFile file = layeredFile(20);
    file.grids[0].quantised[0].layerEnds = ends;
    EXPECT_THROW((void)encodeEsvr(file), RuntimeFailure);
  }
  EsvrFile file = layeredFile(20);
  file.grids[0].layerErrors.pop_back();
  EXPECT_THROW((void)encodeEsvr(file), RuntimeFailure);
}

/// A file on disk.
class PartOfAFile : public testing::Test {
 protected:
  void SetUp() override { writeEsvr(path_, {{}, {grid_}}); }

  [[nodiscard]] std::uint64_t size() const { return std::filesystem::file_size(path_); }

  StoredGrid grid_ = layeredGrid(9000);
  TemporaryFolder folder_;
  std::filesystem::path path_ = folder_ / "part.esvr";
};

TEST_F(PartOfAFile, WithAllLayersIsTheWholeFile) {
  const PartOfFile part = readEsvrPart(path_, {});
  EXPECT_EQ(difference(part.file, {{}, {grid_}}), "");
  EXPECT_LE(part.bytesRead, size());
}

TEST_F(PartOfAFile, WithTheFirstLayersIsTheGridOfTheseLayers) {
  std::uint64_t before = 0;
  for (std::size_t layers = 1; layers <= layerCount(grid_); ++layers) {
    const PartOfFile part = readEsvrPart(path_, {.layers = layers});
    EXPECT_EQ(difference(part.file, {{}, {firstLayers(grid_, layers)}}), "") << layers;
    EXPECT_GT(part.bytesRead, before);
    before = part.bytesRead;
    EXPECT_EQ(encodeEsvr(decodeEsvr(encodeEsvr(part.file), "part")), encodeEsvr(part.file));
  }
  EXPECT_LT(readEsvrPart(path_, {.layers = 1}).bytesRead, size() / 2);
}

TEST_F(PartOfAFile, WithANumberOfEllipsoidsHasWholeLayers) {
  const auto sizes = layerSizes(grid_);
  const auto two = sizes[0].ellipsoids + sizes[1].ellipsoids;
  const auto countOf = [&](std::size_t n) {
    return readEsvrPart(path_, {.ellipsoids = n}).file.grids[0].field.ellipsoidCount();
  };
  EXPECT_EQ(countOf(1), sizes[0].ellipsoids);
  EXPECT_EQ(countOf(sizes[0].ellipsoids), sizes[0].ellipsoids);
  EXPECT_EQ(countOf(sizes[0].ellipsoids + 1), two);
  EXPECT_EQ(countOf(1u << 30), 18000u);
}

TEST_F(PartOfAFile, WithinABoxHasTheSameValues) {
  // The second chunk lies far away, so it is not needed here.
  const Box box{{0, 0, 0}, {9, 9, 9}};
  const PartOfFile part = readEsvrPart(path_, {.box = box});
  EXPECT_EQ(part.file.grids[0].field.chunks[1].ellipsoids.size(), 0u);
  EXPECT_LT(part.bytesRead, size() * 6 / 10);
  EXPECT_EQ(volumeDifference(decodeGrid(part.file.grids[0], {.box = box}),
                             decodeGrid(grid_, {.box = box})),
            "");
}

TEST_F(PartOfAFile, WithinABoxWithoutEllipsoidsHasNone) {
  const Box box{{100000, 0, 0}, {100009, 9, 9}};
  const PartOfFile part = readEsvrPart(path_, {.box = box});
  EXPECT_EQ(part.file.grids[0].field.ellipsoidCount(), 0u);
  EXPECT_LT(part.bytesRead, 2048u);
}

TEST_F(PartOfAFile, DamagedInABlockIsRefusedWhereTheBlockIsRead) {
  CraftedFile file(encodeEsvr({{}, {grid_}}));
  file.section(SectionKind::kLayered).stored.back() ^= std::byte{1};
  const auto bytes = file.assemble();
  EXPECT_THROW((void)decodeEsvr(bytes, "f"), BadInput);
}

/// Offsets in the section (docs/format.md, "Layered ellipsoids"), without rotation thresholds.
namespace directory_at {
constexpr std::size_t kSize = 0, kCount = 4, kCell = 12, kThresholds = 78, kLayers = 79;
}  // namespace directory_at

/// The content with a corrected checksum of its directory.
std::vector<std::byte> repaired(std::vector<std::byte> content) {
  std::uint32_t size = 0;
  std::memcpy(&size, content.data(), sizeof size);
  if (size < 12 || size > content.size()) return content;
  const std::uint64_t sum = format::checksum(std::span(content).first(size - sizeof sum));
  std::memcpy(content.data() + size - sizeof sum, &sum, sizeof sum);
  return content;
}

template <class T>
void expectDirectoryLie(std::size_t offset, T value, const char* answer) {
  CraftedFile file(encodeEsvr(layeredFile(20)));
  file.poke(SectionKind::kLayered, offset, value);
  file.setContent(SectionKind::kLayered, repaired(file.content(SectionKind::kLayered)));
  EXPECT_THAT(refusalToRead(file.assemble()), HasSubstr(answer));
}

/// The offset of the number of layers, which follows the thresholds.
std::size_t layersAt() {
  CraftedFile file(encodeEsvr(layeredFile(20)));
  return directory_at::kLayers + std::to_integer<std::size_t>(file.content(
                                     SectionKind::kLayered)[directory_at::kThresholds]);
}

TEST(LayeredLies, AreFoundOut) {
  const std::size_t layers = layersAt(), ends = layers + 1;
  const std::size_t entries = ends + 4 * sizeof(std::uint64_t);
  expectDirectoryLie(directory_at::kSize, std::uint32_t{11}, "a directory of 11 bytes");
  expectDirectoryLie(directory_at::kSize, 0xffffffffu, "a directory of");
  expectDirectoryLie(directory_at::kCount, std::uint64_t{21}, "with 21 ellipsoids for 20");
  expectDirectoryLie(directory_at::kCell, 0.0, "the cell of the lattice");
  expectDirectoryLie(layers, std::uint8_t{3}, "lie.esvr");
  expectDirectoryLie(layers, std::uint8_t{0}, "not those of the chunk");
  expectDirectoryLie(ends, std::uint64_t{0}, "a layer is empty");
  expectDirectoryLie(ends, std::uint64_t{1} << 60, "a layer is empty or beyond");
  expectDirectoryLie(entries, std::uint8_t{255}, "lie.esvr");
  expectDirectoryLie(entries + 6, 0xffffffffu, "do not lie in the section");
  expectDirectoryLie(entries + 22, std::uint64_t{1}, "checksum of a block");
}

TEST(LayeredLies, ADirectoryThatIsDamagedIsNamed) {
  CraftedFile file(encodeEsvr(layeredFile(20)));
  file.poke(SectionKind::kLayered, directory_at::kCell, 3.0);
  EXPECT_THAT(refusalToRead(file.assemble()), HasSubstr("checksum of the directory"));
}

TEST(LayeredLies, AKilobyteCannotAskForAGigabyte) {
  for (std::uint64_t count = std::uint64_t{1} << 62; count > 20; count /= 2) {
    CraftedFile file(encodeEsvr(layeredFile(20)));
    file.poke(SectionKind::kLayered, directory_at::kCount, count);
    file.setContent(SectionKind::kLayered, repaired(file.content(SectionKind::kLayered)));
    file.poke(SectionKind::kChunks, 36, count);
    const auto bytes = file.assemble();
    ASSERT_LT(bytes.size(), 4096u);
    const AllocationMeter meter;
    EXPECT_THROW((void)decodeEsvr(bytes, "lie"), BadInput) << count;
    EXPECT_LT(meter.bytes(), std::size_t{32} << 20) << count;
  }
}

TEST(LayerErrors, AreRefusedWhereTheyDoNotMatchTheLayers) {
  for (const std::size_t size : {24u, 40u}) {
    CraftedFile file(encodeEsvr(layeredFile(20)));
    file.setContent(SectionKind::kLayerErrors, std::vector<std::byte>(size));
    EXPECT_THAT(refusalToRead(file.assemble()), HasSubstr("a table of 4 layers"));
  }
  CraftedFile file(encodeEsvr(layeredFile(20)));
  file.poke(SectionKind::kLayerErrors, 4, HUGE_VALF);
  EXPECT_THROW((void)decodeEsvr(file.assemble(), "f"), BadInput);
}

}  // namespace

}  // namespace esvr::test
