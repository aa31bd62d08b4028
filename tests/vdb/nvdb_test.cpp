/// Plan: files of NanoVDB's own writer, with every codec and float type and without a directory, are read exactly. Files
/// written by the library are read by NanoVDB's own reader. Files that are cut, damaged or
/// inconsistent are refused.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <algorithm>
#include <cstring>
#include <span>
#include <string_view>

#include "esvr/error.h"
#include "support/machine.h"
#include "support/messages.h"
#include "vdb/foreign_grids.h"
#include "vdb/made_files.h"
#include "vdb/write_nvdb.h"

namespace esvr {
namespace {

using test::NanoCodec;
using testing::HasSubstr;
using Bytes = std::vector<std::byte>;

/// A grid with leaves, tiles of two levels, and a background that is not zero.
openvdb::FloatGrid::Ptr sourceGrid() {
  auto grid = test::smallGrid(0.5f);
  for (int i = 0; i < 300; ++i)
    grid->tree().setValue({i % 20 - 10, i / 20, i % 7}, float(i % 13) / 4.0f);
  grid->tree().addTile(1, {64, 0, 0}, 0.75f, true);
  grid->tree().addTile(2, {1024, 0, 0}, 2.0f, true);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(0.1));
  return grid;
}

class Nvdb : public testing::Test {
 protected:
  [[nodiscard]] std::filesystem::path path() const { return directory_ / "in.nvdb"; }
  void save(const openvdb::GridPtrVec& grids, NanoCodec codec = NanoCodec::kNone) const {
    test::saveNano(path(), grids, codec);
  }
  bool readable(const Bytes& bytes) const {
    test::writeBytes(path(), bytes);
    return test::readable(path(), {.maxBytes = std::uint64_t{32} << 20});
  }
  test::TemporaryFolder directory_;
};

TEST_F(Nvdb, OfEveryCodecReadsAsItsSource) {
  const auto source = sourceGrid();
  test::save(directory_ / "in.vdb", {source});
  const auto expected = readGrid(directory_ / "in.vdb", "density");
  for (const NanoCodec codec : {NanoCodec::kNone, NanoCodec::kZip, NanoCodec::kBlosc}) {
    save({source}, codec);
    const auto listed = inspectVdb(path());
    EXPECT_EQ(listed.format, "NanoVDB");
    ASSERT_EQ(listed.grids.size(), 1u);
    EXPECT_EQ(listed.grids[0].valueType, "float");
    EXPECT_EQ(listed.grids[0].activeVoxels, source->activeVoxelCount());
    EXPECT_EQ(listed.grids[0].activeBox, activeBox(expected.volume));
    const auto grid = readGrid(path(), "density");
    EXPECT_EQ(test::volumeDifference(grid.volume, expected.volume), "");
    EXPECT_EQ(grid.descriptor.name, "density");
    EXPECT_EQ(grid.descriptor.gridClass, GridClass::kFogVolume);
    EXPECT_EQ(grid.descriptor.background, 0.5);
    EXPECT_EQ(grid.descriptor.transform, expected.descriptor.transform);
  }
}

TEST_F(Nvdb, OfDoublesReadsAsItsSource) {
  openvdb::initialize();
  auto source = openvdb::DoubleGrid::create(0.1);
  source->setName("density");
  source->tree().setValue({-1, 2, 3}, 0.3);
  save({source});
  const auto grid = readGrid(path(), "density");
  EXPECT_EQ(grid.descriptor.valueType, ValueType::kDouble);
  EXPECT_EQ(grid.descriptor.background, 0.1);
  EXPECT_EQ(valueAt(grid.volume, {-1, 2, 3}), 0.3f);
}

/// Writes a grid with a quantised type and checks that each value is within `tolerance` of its
/// source.
void expectQuantised(const std::filesystem::path& path, NanoValues values, const char* type,
                     float tolerance) {
  const auto source = sourceGrid();
  test::saveNanoAs(path, *source, values);
  EXPECT_EQ(inspectVdb(path).grids.front().valueType, type);
  const auto grid = readGrid(path, "density");
  EXPECT_EQ(activeVoxelCount(grid.volume), source->activeVoxelCount());
  for (auto value = source->cbeginValueOn(); value; ++value) {
    const auto at = value.getCoord();
    ASSERT_NEAR(valueAt(grid.volume, {at.x(), at.y(), at.z()}), *value, tolerance) << type;
  }
}

TEST_F(Nvdb, OfQuantisedFloatsReadsWithinTheirStep) {
  // A leaf's range is at most 3. The error is half a step of 2^-n of that, and float rounding.
  expectQuantised(path(), NanoValues::kFp4, "fp4", 0.5f * 3 / 15 + 1e-6f);
  expectQuantised(path(), NanoValues::kFp8, "fp8", 0.5f * 3 / 255 + 1e-6f);
  expectQuantised(path(), NanoValues::kFp16, "fp16", 0.5f * 3 / 65535 + 1e-6f);
  expectQuantised(path(), NanoValues::kFpN, "fpn", 0.01f + 1e-6f);  // the default tolerance for fog
}

TEST_F(Nvdb, OfALevelSetKeepsInsideAndOutsideApart) {
  openvdb::initialize();
  auto sphere = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(10.0f, {0, 0, 0}, 1.0f);
  sphere->setName("surface");
  test::save(directory_ / "in.vdb", {sphere});
  save({sphere});
  EXPECT_EQ(test::volumeDifference(readGrid(path(), "surface").volume,
                                   readGrid(directory_ / "in.vdb", "surface").volume),
            "");
}

TEST_F(Nvdb, ListsSeveralGridsAndWhyOneIsSkipped) {
  auto first = test::smallGrid(), second = test::smallGrid(), third = test::smallGrid();
  second->tree().setValue({0, 0, 0}, 2.0f);
  third->clear();
  third->setName("empty");
  save({first, second, third, test::emptyGrid("Tree_vec3s_5_4_3", "vel")});
  const auto grids = inspectVdb(path()).grids;
  ASSERT_EQ(grids.size(), 4u);
  EXPECT_EQ(grids[1].uniqueName, "density[1]");
  EXPECT_THAT(grids[2].skipReason, HasSubstr("no active voxel"));
  EXPECT_THAT(grids[3].skipReason, HasSubstr("no active voxel"));
  EXPECT_FALSE(grids[3].isVector);
  EXPECT_EQ(valueAt(readGrid(path(), "density[1]").volume, {0, 0, 0}), 2.0f);
  EXPECT_THROW((void)readGrid(path(), "vel"), BadInput);
}

/// Vectors in leaves and tiles of two levels, with a background that is not zero.
openvdb::Vec3SGrid::Ptr sourceOfVectors() {
  openvdb::initialize();
  auto grid = openvdb::Vec3SGrid::create({0.5f, 0.0f, -1.0f});
  grid->setName("vel");
  grid->setGridClass(openvdb::GRID_STAGGERED);
  for (int i = 0; i < 300; ++i)
    grid->tree().setValue({i % 20 - 10, i / 20, i % 7}, {float(i), 0.25f * float(i % 3), -1.0f});
  grid->tree().addTile(1, {64, 0, 0}, {0.75f, 1.0f, 2.0f}, true);
  grid->tree().addTile(2, {1024, 0, 0}, {2.0f, 3.0f, 4.0f}, true);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(0.1));
  return grid;
}

void expectSameVectors(const VectorGrid& actual, const VectorGrid& expected) {
  EXPECT_EQ(actual.background, expected.background);
  EXPECT_EQ(actual.descriptor.name, expected.descriptor.name);
  EXPECT_EQ(actual.descriptor.gridClass, expected.descriptor.gridClass);
  EXPECT_EQ(actual.descriptor.transform, expected.descriptor.transform);
  for (std::size_t c = 0; c < kComponents; ++c)
    EXPECT_EQ(test::volumeDifference(actual.components[c], expected.components[c]), "");
}

TEST_F(Nvdb, OfVectorsReadsAsItsSource) {
  const auto source = sourceOfVectors();
  test::save(directory_ / "in.vdb", {source});
  const VectorGrid expected = readVector(directory_ / "in.vdb", "vel");
  save({test::smallGrid(), source}, NanoCodec::kBlosc);
  const GridSummary listed = inspectVdb(path()).grids[1];
  EXPECT_TRUE(listed.isVector);
  EXPECT_THAT(listed.skipReason, HasSubstr("vectors (vec3s)"));
  expectSameVectors(readVector(path(), "vel"), expected);
  const VolumeGrid y = readGrid(path(), "vel.y");
  EXPECT_EQ(y.descriptor.name, "vel.y");
  EXPECT_EQ(test::volumeDifference(y.volume, expected.components[1]), "");
  EXPECT_THROW((void)readGrid(path(), "vel"), BadInput);
  EXPECT_THROW((void)readVector(path(), "density"), BadInput);
  EXPECT_EQ(valueTypeOf(readPacked(path(), "vel")), "vec3s");
}

TEST_F(Nvdb, OfVectorsIsWhatNanoVdbReads) {
  test::save(directory_ / "in.vdb", {sourceOfVectors()});
  VectorGrid grid = readVector(directory_ / "in.vdb", "vel");
  const auto carried = readCarried(directory_ / "in.vdb", std::vector<std::size_t>{0});
  for (const bool isDouble : {false, true}) {
    grid.descriptor.valueType = isDouble ? ValueType::kDouble : ValueType::kFloat;
    const std::vector<GridToWrite> all{&grid, &carried.front()};
    writeGrids(path(), {}, all, {.overwrite = true});
    const auto handles = nanovdb::io::readGrids(path().string());
    ASSERT_EQ(handles.size(), 2u);
    for (const auto& handle : handles) {
      const auto* back = handle.grid<nanovdb::Vec3f>();
      ASSERT_TRUE(back);
      EXPECT_EQ(back->activeVoxelCount(), activeVoxelCount(grid.components[0]));
      EXPECT_EQ(back->gridClass(), nanovdb::GridClass::Staggered);
      EXPECT_EQ(back->tree().background(), nanovdb::Vec3f(0.5f, 0.0f, -1.0f));
      const auto accessor = back->getAccessor();
      for (int i = 0; i < 300; ++i) {
        const Coord at{i % 20 - 10, i / 20, i % 7};
        for (std::size_t c = 0; c < kComponents; ++c)
          ASSERT_EQ(accessor.getValue({at.x, at.y, at.z})[int(c)], valueAt(grid.components[c], at));
      }
      EXPECT_EQ(accessor.getValue({1024, 5, 5}), nanovdb::Vec3f(2.0f, 3.0f, 4.0f));
    }
    expectSameVectors(readVector(path(), "vel[1]"), readVector(directory_ / "in.vdb", "vel"));
  }
}

TEST_F(Nvdb, CannotHoldWhatIsNeitherNumbersNorVectors) {
  test::save(directory_ / "in.vdb", {test::emptyGrid("Tree_int32_5_4_3", "id")});
  const auto carried = readCarried(directory_ / "in.vdb", std::vector<std::size_t>{0});
  EXPECT_THAT(whyNotNano(&carried.front()), HasSubstr("int32"));
  VolumeGrid sheared = test::gridOf("density", {{{0, 0, 0}, 1.0f}});
  EXPECT_EQ(whyNotNano(&sheared), "");
  sheared.descriptor.transform.affine.reset();
  EXPECT_THAT(whyNotNano(&sheared), HasSubstr("affine"));
}

TEST_F(Nvdb, WithNonFiniteVoxelsIsRefusedOrMended) {
  auto source = test::smallGrid();
  source->tree().setValue({0, 0, 5}, std::numeric_limits<float>::quiet_NaN());
  save({source});
  EXPECT_THAT([&] { (void)readGrid(path(), "density"); },
              test::ThrowsSaying<BadInput>("1 voxel is", "(0, 0, 5)"));
  EXPECT_EQ(readGrid(path(), "density", {.nonFinite = NonFinite::kValue}).nonFiniteReplaced, 1u);
}

TEST_F(Nvdb, WithAHugeTileIsRefusedBeforeItIsExpanded) {
  auto source = test::smallGrid();
  source->tree().addTile(3, {4096, 0, 0}, 1.0f, true);
  save({source});
  EXPECT_THAT([&] { (void)readGrid(path(), "density"); },
              test::ThrowsSaying<MemoryExceeded>("bricks"));
}

TEST_F(Nvdb, WrittenIsWhatNanoVdbReads) {
  test::save(directory_ / "in.vdb", {sourceGrid()});
  const auto grid = readGrid(directory_ / "in.vdb", "density");
  writeGrids(directory_ / "out.nvdb", {}, {&grid, 1});
  const auto handle = nanovdb::io::readGrid((directory_ / "out.nvdb").string());
  const auto* back = handle.grid<float>();
  ASSERT_TRUE(back);
  EXPECT_EQ(back->activeVoxelCount(), activeVoxelCount(grid.volume));
  const auto accessor = back->getAccessor();
  for (int i = 0; i < 300; ++i) {
    const Coord at{i % 20 - 10, i / 20, i % 7};
    EXPECT_EQ(accessor.getValue({at.x, at.y, at.z}), valueAt(grid.volume, at));
  }
  EXPECT_EQ(accessor.getValue({64, 0, 0}), 0.75f);
  EXPECT_EQ(back->tree().background(), 0.5f);
  EXPECT_EQ(back->voxelSize()[0], 0.1);
}

TEST_F(Nvdb, CannotHoldHalf) {
  const auto grid = test::gridOf("density", {{{0, 0, 0}, 1.0f}});
  EXPECT_THROW(writeGrids(path(), {}, {&grid, 1}, {.half = HalfMode::kOn}), UsageError);
  EXPECT_EQ(directory_.names().size(), 0u);
}

TEST_F(Nvdb, CutAnywhereIsRefused) {
  for (const NanoCodec codec : {NanoCodec::kNone, NanoCodec::kZip, NanoCodec::kBlosc}) {
    save({sourceGrid()}, codec);
    const Bytes whole = test::bytesIn(path());
    ASSERT_TRUE(readable(whole));
    for (std::size_t size = 0; size < whole.size(); size += 1 + whole.size() / 100)
      EXPECT_FALSE(readable(Bytes(whole.begin(), whole.begin() + std::ptrdiff_t(size)))) << size;
  }
}

TEST_F(Nvdb, AnyByteMayBeWrong) {
  for (const NanoCodec codec : {NanoCodec::kNone, NanoCodec::kZip, NanoCodec::kBlosc}) {
    save({test::smallGrid()}, codec);
    const Bytes whole = test::bytesIn(path());
    // Many bytes of the headers are damaged, and some bytes of the nodes, which are large and mostly
    // empty.
    for (std::size_t i = 0; i < whole.size();
         i += i < 1200 ? test::stride(3) : test::stride(1 + whole.size() / 400)) {
      Bytes damaged = whole;
      damaged[i] ^= i % 2 == 0 ? std::byte{0x80} : std::byte{0xff};
      (void)readable(damaged);
    }
  }
}

TEST_F(Nvdb, OffsetsThatLeadAstrayAreNotFollowed) {
  save({test::smallGrid()});
  const Bytes whole = test::bytesIn(path());
  // The offsets of tree and nodes are 64-bit words whose change moves a node. Whichever words they
  // are, none may lead outside the file.
  const std::int64_t astray[] = {std::int64_t{1} << 40, -(std::int64_t{1} << 40),
                                 std::numeric_limits<std::int64_t>::max(),
                                 std::numeric_limits<std::int64_t>::min(), 32};
  std::size_t refused = 0;
  std::size_t turn = 0;
  for (std::size_t at = 0; at + 8 <= whole.size(); at += at < 1200 ? 8 : 8 * test::stride(293)) {
    const std::span word(whole.data() + at, 8);
    // Most words are 0, entries of nodes that have neither child nor value.
    const bool isUsed = std::ranges::any_of(word, [](std::byte b) { return b != std::byte{0}; });
    for (std::size_t n = 0; n < (isUsed ? std::size(astray) : 1); ++n) {
      Bytes damaged = whole;
      std::memcpy(damaged.data() + at, &astray[turn++ % std::size(astray)], word.size());
      refused += !readable(damaged);
    }
  }
  EXPECT_GT(refused, 20u);
}

TEST_F(Nvdb, OfAnotherMajorVersionIsRefused) {
  save({test::smallGrid()});
  Bytes bytes = test::bytesIn(path());
  for (const auto& [version, text] :
       {std::pair(31u << 21 | 5u << 10 | 7u, "31.5.7"), std::pair(28u, "0.0.28")}) {
    std::memcpy(bytes.data() + 8, &version, sizeof version);
    test::writeBytes(path(), bytes);
    EXPECT_THAT([&] { (void)inspectVdb(path()); },
                test::ThrowsSaying<BadInput>(std::string("written by NanoVDB ") + text + ","));
  }
}

TEST_F(Nvdb, WithTheMagicNumberOfNewerFilesIsRead) {
  save({test::smallGrid()});
  Bytes bytes = test::bytesIn(path());
  bytes[7] = std::byte{'2'};
  test::writeBytes(path(), bytes);
  EXPECT_EQ(activeVoxelCount(readGrid(path(), "density").volume), 3u);
}

/// Buffers begin with another number since NanoVDB 32.6.
Bytes asNewBuffers(Bytes bytes) {
  constexpr std::string_view kOld = "NanoVDB0";
  const auto isOld = [&](std::size_t at) {
    return std::memcmp(bytes.data() + at, kOld.data(), kOld.size()) == 0;
  };
  for (std::size_t at = 0; at + kOld.size() <= bytes.size(); at += 32)  // the alignment of nodes
    if (isOld(at)) bytes[at + 7] = std::byte{'1'};
  return bytes;
}

TEST_F(Nvdb, OfBuffersWithoutADirectoryReadsAsItsSource) {
  const openvdb::GridPtrVec sources{sourceGrid(), sourceOfVectors()};
  test::save(directory_ / "in.vdb", sources);
  const auto expected = readGrid(directory_ / "in.vdb", "density");
  save(sources);
  const auto listed = inspectVdb(path()).grids;
  test::saveNanoBuffers(path(), sources);
  const Bytes old = test::bytesIn(path());
  for (const Bytes& bytes : {old, asNewBuffers(old)}) {
    test::writeBytes(path(), bytes);
    const auto found = inspectVdb(path()).grids;
    ASSERT_EQ(found.size(), listed.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
      EXPECT_EQ(found[i].name, listed[i].name);
      EXPECT_EQ(found[i].valueType, listed[i].valueType);
      EXPECT_EQ(found[i].gridClass, listed[i].gridClass);
      EXPECT_EQ(found[i].activeVoxels, listed[i].activeVoxels);
      EXPECT_EQ(found[i].activeBox, listed[i].activeBox);
      EXPECT_EQ(found[i].storedBytes, listed[i].storedBytes);
    }
    EXPECT_EQ(test::volumeDifference(readGrid(path(), "density").volume, expected.volume), "");
    expectSameVectors(readVector(path(), "vel"), readVector(directory_ / "in.vdb", "vel"));
  }
}

TEST_F(Nvdb, OfBuffersThatAreCutOrDamagedIsRefusedOrRead) {
  test::saveNanoBuffers(path(), {test::smallGrid(), test::smallGrid()});
  const Bytes both = asNewBuffers(test::bytesIn(path()));
  const auto begin = [&](std::size_t size) {
    return Bytes(both.begin(), both.begin() + std::ptrdiff_t(size));
  };
  ASSERT_TRUE(readable(both));
  for (std::size_t size = 0; size < both.size(); size += 1 + both.size() / 20)
    EXPECT_FALSE(readable(begin(size))) << size;
  const Bytes whole = begin(both.size() / 2);  // the first grid
  ASSERT_TRUE(readable(whole));
  constexpr std::size_t kSizeAt = 32, kRootAt = 672 + 24;  // the heads of a grid and of its tree
  const auto readableWith = [&](std::size_t at, std::uint64_t value) {
    Bytes damaged = whole;
    std::memcpy(damaged.data() + at, &value, sizeof value);
    return readable(damaged);
  };
  for (const std::uint64_t value :
       {std::uint64_t{700}, std::uint64_t{1} << 40, std::numeric_limits<std::uint64_t>::max()}) {
    EXPECT_FALSE(readableWith(kSizeAt, value)) << value;
    EXPECT_FALSE(readableWith(kRootAt, value)) << value;
  }
  EXPECT_FALSE(readableWith(kSizeAt, 0));
  for (std::size_t i = 0; i < 800; i += test::stride(7)) {
    Bytes damaged = whole;
    damaged[i] ^= std::byte{0x80};
    (void)readable(damaged);
  }
}

TEST(VdbVersions, NamesBothLibraries) {
  EXPECT_THAT(vdbVersions(), testing::MatchesRegex("OpenVDB [0-9.]+, NanoVDB [0-9.]+"));
}

}  // namespace
}  // namespace esvr
