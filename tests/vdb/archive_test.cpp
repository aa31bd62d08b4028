// Plan: what an archive is and what it is not. Everything that is not a valid VDB file is refused with a
// BadInput that names it. Grids are read as bytes and written again between grids of voxels; OpenVDB's own
// reader reads the results, and the bytes that come back are compared with those of the source. Then files
// are cut at every position, and every byte is damaged: small files of each packing completely, and real
// ones at many positions. Each file is either read as a valid finite volume or refused with BadInput. Values
// that OpenVDB would believe (chunk sizes, lengths of names, counts) are damaged on purpose.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openvdb/io/Stream.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <memory>
#include <numeric>
#include <random>
#include <string>
#include <string_view>
#include <utility>

#include "esvr/error.h"
#include "support/machine.h"
#include "support/messages.h"
#include "vdb/foreign_grids.h"
#include "vdb/made_files.h"

namespace esvr {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class Input : public testing::Test {
 protected:
  void expectRefused(const std::filesystem::path& path, const std::string& why) const {
    const auto says = test::ThrowsSaying<BadInput>(path.string(), why);
    EXPECT_THAT([&] { (void)inspectVdb(path); }, says);
    EXPECT_THAT([&] { (void)readGrid(path, "density"); }, says);
  }
  [[nodiscard]] std::filesystem::path fileWith(const std::string& text) const {
    std::ofstream(directory_ / "text.vdb") << text;
    return directory_ / "text.vdb";
  }
  test::TemporaryFolder directory_;
};

TEST_F(Input, IsRefusedWhereItIsNoVolume) {
  expectRefused(directory_ / "missing.vdb", "no such file");
  expectRefused(directory_.path(), "is a directory");
  expectRefused("/dev/null", "not a regular file");
  expectRefused(fileWith(""), "is empty");
  for (const char* text : {" ", "#Blender's idea of a volume\n"})
    expectRefused(fileWith(text), "neither an OpenVDB nor a NanoVDB");
}

// OpenVDB 13 writes version 225 into every file, and nothing else changed for float grids.
TEST_F(Input, IsRefusedIfItIsTooOldAndTriedIfItIsNewer) {
  test::save(directory_ / "a.vdb", {test::smallGrid()});
  auto bytes = test::bytesIn(directory_ / "a.vdb");
  for (const int version : {221, 225}) {
    bytes[8] = std::byte(version);  // it follows the magic number
    test::writeBytes(directory_ / "a.vdb", bytes);
    if (version == 221)
      expectRefused(directory_ / "a.vdb", "version 221");
    else
      EXPECT_EQ(activeVoxelCount(readGrid(directory_ / "a.vdb", "density").volume), 3u);
  }
}

/// Grids of several types, two of which share a tree. The last one is of a type that unknownWords() changes.
openvdb::GridPtrVec gridsOfAllKinds() {
  auto density = test::smallGrid();
  for (int i = 0; i < 3000; ++i)
    density->tree().setValue({i % 20, i / 20, (i * i) % 41}, float(i % 13) / 4.0f);
  density->tree().addTile(1, {64, 0, 0}, 0.5f, true);
  auto half = openvdb::gridPtrCast<openvdb::FloatGrid>(density->deepCopyGrid());
  half->setName("half");
  half->setSaveFloatAsHalf(true);
  auto instance = openvdb::FloatGrid::create(density->treePtr());
  instance->setName("instance");
  instance->setTransform(openvdb::math::Transform::createLinearTransform(0.25));
  openvdb::GridPtrVec all{density, half, instance};
  const auto add = [&]<class Grid>(const std::shared_ptr<Grid>& grid, const char* name,
                                   const typename Grid::ValueType& value) {
    grid->setName(name);
    for (int i = 0; i < 500; ++i) grid->tree().setValue({i % 9, i / 9, 5 * (i % 4)}, value);
    all.push_back(grid);
  };
  add(openvdb::DoubleGrid::create(1.0), "double", 0.1);
  add(openvdb::Vec3SGrid::create(), "velocity", {1.0f, 2.0f, 3.0f});
  add(test::registeredGrid<openvdb::Vec3IGrid>(), "index", {1, 2, 3});
  add(openvdb::Int32Grid::create(), "id", 7);
  add(openvdb::Int64Grid::create(), "big", 7);
  add(openvdb::BoolGrid::create(), "flag", true);
  add(test::registeredGrid<openvdb::MaskGrid>(), "mask", true);
  all.push_back(test::emptyGrid("Tree_ptidx32_5_4_3", "words"));
  return all;
}

/// Makes "words" a grid of strings, which OpenVDB cannot read, in a written file.
void unknownWords(const std::filesystem::path& path) {
  auto bytes = test::bytesIn(path);
  const std::string_view known = "Tree_ptidx32_5_4_3", unknown = "Tree_strings_5_4_3";
  const auto is = [](std::byte byte, char letter) { return char(byte) == letter; };
  const auto at = std::search(bytes.begin(), bytes.end(), known.begin(), known.end(), is);
  ASSERT_NE(at, bytes.end());
  std::transform(unknown.begin(), unknown.end(), at, [](char letter) { return std::byte(letter); });
  test::writeBytes(path, bytes);
}

void stream(const std::filesystem::path& path, const openvdb::GridPtrVec& grids,
            const openvdb::MetaMap& metadata = {}) {
  std::ofstream file(path, std::ios::binary);
  openvdb::io::Stream(file).write(grids, metadata);
}

/// A file that OpenVDB writes to a stream has no positions of grids; all else is as in a file.
TEST_F(Input, OfAStreamIsReadLikeThatOfAFile) {
  openvdb::initialize();
  const auto file = directory_ / "file.vdb", streamed = directory_ / "stream.vdb";
  openvdb::MetaMap metadata;
  metadata.insertMeta("note", openvdb::StringMetadata("about this file"));
  const auto grids = gridsOfAllKinds();
  test::save(file, grids, metadata);
  stream(streamed, grids, metadata);
  for (const auto& path : {file, streamed}) unknownWords(path);
  const VdbSummary expected = inspectVdb(file), got = inspectVdb(streamed);
  EXPECT_EQ(got.metadata.size(), expected.metadata.size());
  ASSERT_EQ(got.grids.size(), expected.grids.size());
  for (std::size_t g = 0; g < got.grids.size(); ++g) {
    const GridSummary &a = got.grids[g], &b = expected.grids[g];
    EXPECT_EQ(a.uniqueName, b.uniqueName);
    EXPECT_EQ(a.valueType, b.valueType) << a.name;
    EXPECT_EQ(a.activeVoxels, b.activeVoxels) << a.name;
    EXPECT_EQ(a.storedBytes, b.storedBytes) << a.name;
    if (a.isScalar) {
      EXPECT_EQ(readGrid(streamed, a.uniqueName).volume.values,
                readGrid(file, a.uniqueName).volume.values);
    }
    const auto carried = readCarried(streamed, {&g, 1}), same = readCarried(file, {&g, 1});
    EXPECT_EQ(carried.front().bytes, same.front().bytes) << a.name;
    if (a.name != "words") {
      EXPECT_EQ(carried.front().blocksAt, same.front().blocksAt) << a.name;
    }
  }
}

TEST_F(Input, OfAStreamIsRefusedBehindATreeWhoseEndIsUnknown) {
  openvdb::initialize();
  auto grids = gridsOfAllKinds();
  std::swap(grids.front(), grids.back());
  stream(directory_ / "words_first.vdb", grids);
  unknownWords(directory_ / "words_first.vdb");
  expectRefused(directory_ / "words_first.vdb", "or with this grid as the last one");
}

/// The head of each grid has a name that reaches over all later grids.
TEST_F(Input, IsRefusedIfTheHeadsOfGridsOverlap) {
  std::string bytes;
  const auto put = [&](const auto& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  constexpr std::int32_t kGrids = 200, kRowBytes = 4 + 4 + 1 + 4 + 24, kHeadBytes = 12;
  put(std::int64_t(openvdb::OPENVDB_MAGIC));
  for (const std::uint32_t number : {224u, 10u, 0u}) put(number);
  bytes += '\x01' + std::string(36, '0');
  put(std::uint32_t{0});  // items of the file
  put(kGrids);
  const std::size_t end = bytes.size() + std::size_t(kGrids) * (kRowBytes + kHeadBytes);
  for (std::int32_t g = 0; g < kGrids; ++g) {
    const auto head = std::int64_t(bytes.size()) + kRowBytes;
    put(std::uint32_t{0});  // name
    put(std::uint32_t{1});
    bytes += 'Z';           // type
    put(std::uint32_t{0});  // parent
    for (const std::int64_t position : {head, head, head + kHeadBytes}) put(position);
    put(std::uint32_t{0});                                         // compression
    put(std::uint32_t{1});                                         // items
    put(std::uint32_t(end + 1 - std::size_t(head) - kHeadBytes));  // length of the item's name
  }
  bytes += std::string(200, 'x');
  expectRefused(fileWith(bytes), "this part of the file ends");
}

TEST_F(Input, RealFileOfAStreamIsRead) {
  ESVR_NEEDS_DATA();
  const auto path = test::dataDir() / "edge/faults/stream_no_offsets.vdb";
  const VdbSummary summary = inspectVdb(path);
  ASSERT_EQ(summary.grids.size(), 1u);
  EXPECT_EQ(summary.grids[0].name, "surface");
  EXPECT_EQ(summary.grids[0].activeVoxels, 0x1836u);
  EXPECT_EQ(activeVoxelCount(readGrid(path, "surface").volume), 0x1836u);
}

TEST_F(Input, MayBeDeletedOnceRead) {
  const auto path = directory_ / "in.vdb";
  test::save(path, {test::smallGrid()});
  const auto grid = readGrid(path, "density");
  std::filesystem::remove(path);
  EXPECT_EQ(valueAt(grid.volume, {7, 0, 0}), 1.0f);
}

std::vector<CarriedGrid> carryAll(const std::filesystem::path& path) {
  std::vector<std::size_t> places(inspectVdb(path).grids.size());
  std::iota(places.begin(), places.end(), std::size_t{0});
  return readCarried(path, places);
}

std::vector<GridToWrite> toWrite(const std::vector<CarriedGrid>& grids) {
  std::vector<GridToWrite> all;
  for (const auto& grid : grids) all.emplace_back(&grid);
  return all;
}

std::vector<std::string> uniqueNamesIn(const std::filesystem::path& path) {
  std::vector<std::string> names;
  for (const auto& grid : inspectVdb(path).grids) names.push_back(grid.uniqueName);
  return names;
}

constexpr std::size_t kVersionAt = 8;  // place of the version of the format in a .vdb file

class Carried : public testing::Test {
 protected:
  [[nodiscard]] std::filesystem::path in() const { return directory_ / "in.vdb"; }
  [[nodiscard]] std::filesystem::path out() const { return directory_ / "out.vdb"; }

  /// Carries all grids of a file and expects that they come back bit for bit.
  void expectBack(const std::filesystem::path& source) const {
    const auto grids = carryAll(source);
    writeGrids(out(), {}, toWrite(grids), {.overwrite = true});
    EXPECT_EQ(test::withoutVersion(carryAll(out())), test::withoutVersion(grids));
  }

  test::TemporaryFolder directory_;
};

TEST_F(Carried, GridsOfEveryTypeComeBackBitForBit) {
  openvdb::GridPtrVec grids;
  for (const char* type : {"bool", "mask", "int32", "int64", "vec3s", "vec3d", "ptdataidx32"})
    grids.push_back(test::emptyGrid(std::string("Tree_") + type + "_5_4_3", type));
  grids.push_back(test::smallGrid());
  test::save(in(), grids);
  expectBack(in());
  for (const auto& grid : grids) {
    const auto back = test::load(out(), grid->getName());
    EXPECT_EQ(back->type(), grid->type());
    EXPECT_EQ(back->activeVoxelCount(), grid->activeVoxelCount());
  }
}

TEST_F(Carried, GridsComeBackBetweenGridsOfVoxelsWithTheirNames) {
  const auto first = test::emptyGrid("Tree_int32_5_4_3", "a");
  const auto last = test::emptyGrid("Tree_bool_5_4_3", "");
  test::save(in(), {first, last});
  const auto carried = carryAll(in());
  const VolumeGrid a = test::gridOf("a", {{{0, 0, 0}, 1.0f}});
  const VolumeGrid b = test::gridOf("b", {{{5, 0, 0}, 2.0f}});
  const std::vector<GridToWrite> all{&a, &carried[0], &b, &carried[1], &carried[1]};
  writeGrids(out(), {}, all);
  EXPECT_THAT(uniqueNamesIn(out()),
              ElementsAre("a[0]", "a[1]", "b", "(unnamed)[0]", "(unnamed)[1]"));
  EXPECT_EQ(test::load(out(), "a[1]")->type(), first->type());
  EXPECT_EQ(test::load(out(), "[1]")->type(), last->type());
  EXPECT_EQ(test::volumeDifference(readGrid(out(), "b").volume, b.volume), "");
}

TEST_F(Carried, GridThatSharesATreeGetsACopyOfIt) {
  const auto owner = test::smallGrid();
  const auto instance = owner->copyGrid();  // of the same tree
  instance->setName("instance");
  instance->insertMeta("note", openvdb::StringMetadata("of the instance"));
  test::save(in(), {owner, instance});
  ASSERT_LT(inspectVdb(in()).grids[1].storedBytes, inspectVdb(in()).grids[0].storedBytes);
  const std::size_t place = 1;
  const auto carried = readCarried(in(), {&place, 1});
  writeGrids(out(), {}, toWrite(carried));
  const auto back = openvdb::gridPtrCast<openvdb::FloatGrid>(test::load(out(), "instance"));
  EXPECT_EQ(back->tree().getValue({7, 0, 0}), 1.0f);
  EXPECT_EQ(back->metaValue<std::string>("note"), "of the instance");
}

TEST_F(Carried, GridHasTheVoxelsOfTheFile) {
  test::save(in(), {test::smallGrid(0.125f)});
  const auto grids = carryAll(in());
  const VolumeGrid direct = readGrid(in(), "density"), carried = readGrid(grids.front());
  EXPECT_EQ(test::volumeDifference(carried.volume, direct.volume), "");
  EXPECT_EQ(carried.descriptor, direct.descriptor);
  EXPECT_EQ(inspectCarried(grids.front()).activeVoxels, 3u);
}

TEST_F(Carried, GridOfATypeThatOpenVdbDoesNotKnowComesBack) {
  test::save(in(), {test::smallGrid()});
  auto bytes = test::bytesIn(in());
  const std::string known = "Tree_float_5_4_3", odd = "Tree_quux_5_4_33";
  const auto at = std::search(bytes.begin(), bytes.end(), known.begin(), known.end(),
                              [](std::byte b, char c) { return b == std::byte(c); });
  ASSERT_NE(at, bytes.end());
  std::memcpy(&*at, odd.data(), odd.size());
  test::writeBytes(in(), bytes);
  expectBack(in());
  EXPECT_EQ(carryAll(out()).front().treeType, odd);
}

TEST_F(Carried, FiveHundredGridsOfOneNameComeBackInOrder) {
  openvdb::GridPtrVec grids;
  for (int i = 0; i < 500; ++i) {
    grids.push_back(test::emptyGrid("Tree_int32_5_4_3", "many"));
    grids.back()->insertMeta("number", openvdb::Int32Metadata(i));
  }
  test::save(in(), grids);
  expectBack(in());
  EXPECT_EQ(test::load(out(), "many[499]")->metaValue<std::int32_t>("number"), 499);
}

TEST_F(Carried, SlowMetadataOfFiftyMegabytesComeBack) {
  const auto grid = test::emptyGrid("Tree_int32_5_4_3", "large");
  grid->insertMeta("text", openvdb::StringMetadata(std::string(50'000'000, 'x')));
  test::save(in(), {grid});
  expectBack(in());
}

TEST_F(Carried, GridsLargerThanTheLimitAreRefusedWithTheirSize) {
  const auto grid = test::emptyGrid("Tree_int32_5_4_3", "large");
  grid->insertMeta("text", openvdb::StringMetadata(std::string(1'000'000, 'x')));
  test::save(in(), {grid});
  const std::size_t place = 0;
  EXPECT_THAT(
      [&] {
        (void)readCarried(in(), {&place, 1}, {.maxBytes = 100'000});
      },
      test::ThrowsSaying<MemoryExceeded>("in.vdb", "\"large\"", "1 MB"));
  const VoxelMemory files({.folder = directory_ / ".", .maxHeapBytes = 1000});
  const auto inFile = readCarried(in(), {&place, 1}, {.maxBytes = 100'000, .memory = files});
  EXPECT_EQ(inFile.front().bytes.size(), inspectVdb(in()).grids.front().storedBytes);
}

TEST_F(Carried, GridsCannotBeWrittenToNanoVdb) {
  test::save(in(), {test::emptyGrid("Tree_vec3s_5_4_3", "v")});
  const auto grids = carryAll(in());
  EXPECT_THAT([&] { writeGrids(directory_ / "out.nvdb", {}, toWrite(grids)); },
              test::ThrowsSaying<UsageError>("\"v\"", ".vdb"));
}

TEST_F(Carried, GridsOfAnotherVersionOfTheFormatAreRefused) {
  test::save(in(), {test::smallGrid(), test::emptyGrid("Tree_ptdataidx32_5_4_3", "p")});
  EXPECT_THAT(inspectVdb(in()).grids[1].whyNotCarried, IsEmpty());
  auto bytes = test::bytesIn(in());
  bytes[kVersionAt] = std::byte(223);
  test::writeBytes(in(), bytes);
  const auto grids = inspectVdb(in()).grids;
  EXPECT_THAT(grids[0].whyNotCarried, IsEmpty());
  EXPECT_THAT(grids[1].whyNotCarried, HasSubstr("223"));
  EXPECT_THAT([&] { (void)carryAll(in()); }, test::ThrowsSaying<BadInput>("223"));

  const std::size_t place = 0;
  auto future = readCarried(in(), {&place, 1});
  future.front().vdbVersion = 1000;
  EXPECT_THAT([&] { writeGrids(out(), {}, toWrite(future)); },
              test::ThrowsSaying<RuntimeFailure>("density", "1000"));
}

TEST_F(Carried, GridsOfTheFormatOfOpenVdb13AreCarriedByEarlierVersionsToo) {
  test::save(in(), {test::smallGrid(), test::emptyGrid("Tree_ptdataidx32_5_4_3", "p")});
  const auto here = carryAll(in());
  auto bytes = test::bytesIn(in());
  bytes[kVersionAt] = std::byte(225);
  test::writeBytes(in(), bytes);
  EXPECT_EQ(test::withoutVersion(carryAll(in())), test::withoutVersion(here));
  expectBack(in());
}

TEST_F(Carried, RealFilesComeBackBitForBit) {
  ESVR_NEEDS_DATA();
  for (const char* file : {"edge/points_only.vdb", "edge/unregistered_type.vdb",
                           "edge/vec3_velocity.vdb", "sequence/gas_0001.vdb"}) {
    SCOPED_TRACE(file);
    expectBack(test::dataDir() / file);
  }
}

using Bytes = std::vector<std::byte>;

/// Damage may turn a bit into a large active tile, which is not worth building.
const ReadOptions kSmall{.maxBytes = std::uint64_t{8} << 20};

class Damage : public testing::Test {
 protected:
  bool readable(const Bytes& bytes) const {
    test::writeBytes(path(), bytes);
    return test::readable(path(), kSmall);
  }
  [[nodiscard]] std::filesystem::path path() const { return directory_ / "damaged.vdb"; }

  /// A file with metadata, a tile, a frustum and several leaves.
  Bytes madeFile(std::uint32_t compression, bool half) const {
    auto grid = test::smallGrid();
    for (int i = 0; i < 400; ++i)
      grid->tree().setValue({i % 20, i / 20, i % 7}, float(i % 13) / 4.0f);
    grid->tree().addTile(1, {64, 0, 0}, 0.5f, true);
    grid->insertMeta("note", openvdb::StringMetadata("about this grid"));
    grid->setSaveFloatAsHalf(half);
    grid->setGridClass(openvdb::GRID_UNKNOWN);  // OpenVDB zips grids of this class only
    grid->setTransform(openvdb::math::Transform::createFrustumTransform(
        {openvdb::Vec3d(0), openvdb::Vec3d(100)}, 0.5, 1.0, 0.1));
    test::saveCompressed(path(), {grid}, compression);
    return test::bytesIn(path());
  }

  test::TemporaryFolder directory_;
};

/// The offset at which the bytes of `text` begin.
std::size_t find(const Bytes& bytes, const std::string& text) {
  const auto* needle = reinterpret_cast<const std::byte*>(text.data());
  const auto it = std::search(bytes.begin(), bytes.end(), needle, needle + text.size());
  EXPECT_NE(it, bytes.end());
  return std::size_t(it - bytes.begin());
}

template <class T>
Bytes withValueAt(Bytes bytes, std::size_t at, T value) {
  std::memcpy(bytes.data() + at, &value, sizeof value);
  return bytes;
}

using openvdb::io::COMPRESS_ACTIVE_MASK, openvdb::io::COMPRESS_BLOSC, openvdb::io::COMPRESS_NONE,
    openvdb::io::COMPRESS_ZIP;
constexpr std::uint32_t kEveryCodec[] = {COMPRESS_NONE, COMPRESS_ACTIVE_MASK | COMPRESS_ZIP,
                                         COMPRESS_ACTIVE_MASK | COMPRESS_BLOSC};

TEST_F(Damage, AFileCutAnywhereIsRefused) {
  for (const auto compression : kEveryCodec) {
    const Bytes whole = madeFile(compression, false);
    ASSERT_TRUE(readable(whole));
    for (std::size_t size = 0; size < whole.size(); size += 1 + whole.size() / 100)
      EXPECT_FALSE(readable(Bytes(whole.begin(), whole.begin() + std::ptrdiff_t(size)))) << size;
  }
}

TEST_F(Damage, AnyByteMayBeWrong) {
  constexpr std::size_t kHead = 1200;  // header, directory, metadata and map; then nodes
  std::size_t refused = 0;
  std::mt19937 random(1);
  for (const auto compression : kEveryCodec)
    for (const bool half : {false, true}) {
      const Bytes whole = madeFile(compression, half);
      for (std::size_t i = 0; i < whole.size();
           i += i < kHead ? test::stride(3) : test::stride(1 + whole.size() / 400)) {
        Bytes damaged = whole;
        damaged[i] ^= random() % 2 == 0 ? std::byte{0x80} : std::byte{0xff};
        refused += !readable(damaged);
      }
    }
  EXPECT_GT(refused, 500u / test::kFewerTrials);
}

TEST_F(Damage, AnyByteOfALeafMayBeWrong) {
  for (const auto compression : kEveryCodec) {
    test::saveCompressed(path(), {test::smallGrid()}, compression);
    const Bytes whole = test::bytesIn(path());
    // The last leaf's mask, packing, chunk size, chunk header and the first of its values.
    const std::size_t leafBytes = std::min<std::size_t>(whole.size(), compression ? 110 : 2200);
    for (std::size_t i = whole.size() - leafBytes; i < whole.size() - leafBytes + 110; ++i)
      for (const int bits : {0x01, 0x80}) {
        Bytes damaged = whole;
        damaged[i] ^= std::byte(bits);
        (void)readable(damaged);
      }
  }
}

// A leaf's mask is in the file twice, the second time before its values.
TEST_F(Damage, ALeafWithoutTheActiveVoxelsOfItsTreeIsRefused) {
  test::saveCompressed(path(), {test::smallGrid()}, COMPRESS_NONE);
  Bytes bytes = test::bytesIn(path());
  constexpr std::size_t kPacking = 1;
  const std::size_t mask =
      bytes.size() - kBrickVoxels * sizeof(float) - kPacking - sizeof(BrickMask);
  std::fill_n(bytes.begin() + std::ptrdiff_t(mask), sizeof(BrickMask), std::byte{0});
  test::writeBytes(path(), bytes);
  EXPECT_THAT([&] { (void)readGrid(path(), "density"); },
              test::ThrowsSaying<BadInput>("two different masks"));
}

TEST_F(Damage, ANegativeChunkSizeDoesNotOverrunTheLeaf) {
  test::saveCompressed(path(), {test::smallGrid()}, COMPRESS_ZIP | COMPRESS_ACTIVE_MASK);
  auto grid = test::smallGrid();
  grid->setGridClass(openvdb::GRID_UNKNOWN);
  test::saveCompressed(path(), {grid}, COMPRESS_ZIP | COMPRESS_ACTIVE_MASK);
  const Bytes whole = test::bytesIn(path());
  // Three floats do not shrink, so the file ends with their negative size, -12, and the floats.
  const std::size_t at = whole.size() - 12 - 8;
  std::int64_t size = 0;
  std::memcpy(&size, whole.data() + at, sizeof size);
  ASSERT_EQ(size, -12);
  for (const std::int64_t wrong :
       {std::int64_t{-13}, std::int64_t{-4000}, std::int64_t{1},
        std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max()})
    EXPECT_FALSE(readable(withValueAt(whole, at, wrong))) << wrong;
}

TEST_F(Damage, HugeCountsAndLengthsAskForNoMemory) {
  test::save(path(), {test::smallGrid()});
  const Bytes whole = test::bytesIn(path());
  constexpr std::uint32_t kHuge = 0xfffffff0u;
  constexpr std::size_t kMetadataCount = 8 + 4 + 4 + 4 + 1 + 36;  // follows the header
  EXPECT_FALSE(readable(withValueAt(whole, kMetadataCount, kHuge)));
  EXPECT_FALSE(readable(withValueAt(whole, kMetadataCount + 4, kHuge)));  // grids
  for (const char* text : {"density", "Tree_float_5_4_3", "class", "fog volume",
                           "file_delayed_load", "UniformScaleMap"})
    EXPECT_FALSE(readable(withValueAt(whole, find(whole, text) - 4, kHuge))) << text;
}

TEST_F(Damage, ADirectoryThatRunsInCirclesEnds) {
  test::save(path(), {test::smallGrid(), test::smallGrid()});
  const Bytes whole = test::bytesIn(path());
  constexpr std::size_t kGridCount = 8 + 4 + 4 + 4 + 1 + 36 + 4;
  const std::size_t positions = find(whole, "Tree_float_5_4_3") + 16 + 4;
  auto circle = withValueAt(whole, kGridCount, std::int32_t{0x7fffffff});
  circle = withValueAt(circle, positions + 16, std::int64_t{kGridCount + 4});  // itself
  EXPECT_FALSE(readable(circle));
  EXPECT_FALSE(readable(withValueAt(whole, positions, std::int64_t{-1})));
  EXPECT_FALSE(readable(withValueAt(whole, positions + 16, std::int64_t{1} << 60)));
}

TEST_F(Damage, AFrustumWithinAFrustumIsRefused) {
  const Bytes whole = madeFile(COMPRESS_NONE, false);
  const std::size_t outer = find(whole, "NonlinearFrustumMap");
  const std::size_t inner = outer + 19 + 64;  // its own numbers precede its second map
  Bytes nested(whole.begin(), whole.begin() + std::ptrdiff_t(inner));
  nested.insert(nested.end(), whole.begin() + std::ptrdiff_t(outer) - 4, whole.end());
  test::writeBytes(path(), nested);
  EXPECT_THAT([&] { (void)inspectVdb(path()); },
              test::ThrowsSaying<BadInput>("frustum within a frustum"));
}

TEST_F(Damage, RealFilesCutOrAlteredDoNoHarm) {
  ESVR_NEEDS_DATA();
  std::mt19937 random(1);
  for (const char* name : {"edge/background_one.vdb", "edge/three_grids_named_density.vdb",
                           "dragon_with_xform.vdb", "aneurism.vdb", "edge/double_grid.vdb"}) {
    const Bytes whole = test::bytesIn(test::dataDir() / name);
    for (int i = 0; i < 20; ++i) {
      const std::size_t size = random() % whole.size();
      EXPECT_FALSE(readable(Bytes(whole.begin(), whole.begin() + std::ptrdiff_t(size)))) << size;
      Bytes damaged = whole;
      damaged[random() % whole.size()] ^= std::byte(1 + random() % 255);
      (void)readable(damaged);
    }
  }
}

}  // namespace
}  // namespace esvr
