// Plan: quantised chunks are decoded integer by integer. Wrong sections are detected before memory
// is allocated for them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "esvr/container.h"
#include "esvr/error.h"
#include "format/allocation_meter.h"
#include "format/crafted_file.h"
#include "format/sample_files.h"
#include "support/trials.h"

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

TEST(QuantisedFile, EncodingAgainGivesTheSameBytes) {
  const auto bytes = encodeEsvr(quantisedFile(5000));
  EXPECT_EQ(encodeEsvr(decodeEsvr(bytes, "memory")), bytes);
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

}  // namespace
}  // namespace esvr::test
