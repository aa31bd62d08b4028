// Plan: the tests read small files that need much memory: files with one huge scale, with extreme
// scales, and with metadata, voxels and ellipsoids that take almost no bytes. Each is refused
// before memory is allocated, with the number of bytes in the message. Within the limit, the same
// content is read.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "esvr/container.h"
#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "format/allocation_meter.h"
#include "format/byte_source.h"
#include "format/crafted_file.h"
#include "format/decode.h"
#include "format/sample_files.h"

namespace esvr {
namespace {

using format::SectionKind;
using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr std::uint64_t kMegabyte = 1 << 20;

StoredGrid gridOfScale(float logScale) {
  StoredGrid grid = test::emptyGrid();
  grid.descriptor.name = "smoke";
  grid.withinRange = false;
  grid.activeBox = {{-100'000, -100'000, -100'000}, {100'000, 100'000, 100'000}};
  grid.field.chunks = {{{}, test::sampleEllipsoids(4, 1)}};
  grid.field.chunks[0].ellipsoids.logScale[1][2] = logScale;
  return grid;
}

EsvrFile readWithin(const std::vector<std::byte>& bytes, std::uint64_t maxBytes) {
  return format::decode(format::MemorySource(bytes, "small.esvr"), {maxBytes});
}

void expectRefused(const EsvrFile& file, std::uint64_t maxBytes) {
  const auto bytes = encodeEsvr(file);
  EXPECT_EQ(test::difference(readWithin(bytes, kNoMemoryLimit), file), "");
  const test::AllocationMeter meter;
  EXPECT_THAT(
      [&] { (void)readWithin(bytes, maxBytes); },
      ThrowsMessage<MemoryExceeded>(AllOf(HasSubstr("small.esvr"), HasSubstr("MB are allowed"))));
  EXPECT_LT(meter.bytes(), maxBytes);
}

TEST(Limits, OneHugeScaleIsRefusedBeforeAnythingIsEvaluated) {
  StoredGrid grid = gridOfScale(6.0f);
  for (auto& scale : grid.field.chunks[0].ellipsoids.logScale) scale[2] = 6.0f;
  const DecodeOptions options{.maxBytes = 1000 * kMegabyte};
  EXPECT_GT(estimateDecode(grid, options).bytes(), 5e9);
  const test::AllocationMeter meter;
  EXPECT_THAT([&] { (void)decodeGrid(grid, options); },
              ThrowsMessage<MemoryExceeded>(AllOf(HasSubstr("smoke"), HasSubstr("1.05 GB"))));
  EXPECT_LT(meter.bytes(), kMegabyte);
}

TEST(Limits, ABoxOfAHugeScaleIsDecoded) {
  StoredGrid grid = gridOfScale(0.0f);
  for (auto& scale : grid.field.chunks[0].ellipsoids.logScale) scale[2] = 18.0f;
  const DecodeOptions options{.box = Box{{0, 0, 0}, {15, 7, 7}}, .maxBytes = 100 * kMegabyte};
  EXPECT_EQ(decodeGrid(grid, options).brickCount(), 2u);
}

TEST(Limits, StoredBricksBoundTheWorkOfAHugeScale) {
  StoredGrid grid = gridOfScale(0.0f);
  for (auto& scale : grid.field.chunks[0].ellipsoids.logScale) scale[2] = 30.0f;
  grid.topology = TopologyKind::kBricks;
  grid.bricks = {{0, 0, 0}, {0, 0, 8}, {8000, 0, 0}};
  EXPECT_LE(decodeGrid(grid, {.maxBytes = 100 * kMegabyte}).brickCount(), 3u);
}

class ExtremeScale : public testing::TestWithParam<float> {};

TEST_P(ExtremeScale, IsNeitherWrittenNorBelieved) {
  const StoredGrid grid = gridOfScale(GetParam());
  EXPECT_THAT([&] { (void)encodeEsvr(test::fileOf(grid)); },
              ThrowsMessage<RuntimeFailure>(HasSubstr("a scale of ellipsoid 2")));
  test::CraftedFile file(encodeEsvr(test::fileOf(gridOfScale(0.0f))));
  file.poke(SectionKind::kScales, (4 + 2) * sizeof(float), GetParam());
  EXPECT_THAT([&] { (void)decodeEsvr(file.assemble(), "lie.esvr"); },
              ThrowsMessage<BadInput>(AllOf(HasSubstr("lie.esvr"), HasSubstr("a scale of"))));
}
INSTANTIATE_TEST_SUITE_P(Scales, ExtremeScale, testing::Values(33.0f, 1e3f, 3e38f, -33.0f, -1e30f));

TEST(Limits, MetadataThatIsWideInMemoryIsRefused) {
  EsvrFile file = test::fileOf(test::emptyGrid());
  file.metadata.assign(100'000, MetaItem{});
  expectRefused(file, 4 * kMegabyte);
}

TEST(Limits, SlowVoxelsThatCostNextToNothingAreRefused) {
  std::vector<BrickInput> bricks;
  for (int i = 0; i < 2000; ++i) {
    BrickInput brick{{8 * (i % 100), 8 * (i / 100), 0}, {}, {}};
    brick.values.fill(1.0f);
    brick.active.setAll();
    bricks.push_back(brick);
  }
  StoredGrid grid = test::emptyGrid();
  grid.field.background = 0.0f;
  grid.voxels = exactLayer(makeVolume(std::move(bricks), 0.0f));
  const EsvrFile file = test::fileOf(grid);
  EXPECT_LT(encodeEsvr(file).size(), 8'000u);
  expectRefused(file, 8 * kMegabyte);
}

}  // namespace
}  // namespace esvr
