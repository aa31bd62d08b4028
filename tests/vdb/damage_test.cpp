/// Plan: files are cut at every position, and every byte is damaged; small files of each packing
/// completely, and real ones at many positions. Each file is either read as a valid finite volume
/// or refused with BadInput. Values that OpenVDB would believe (chunk sizes, lengths of names,
/// counts) are damaged on purpose.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "esvr/error.h"
#include "vdb/made_files.h"
#include "vdb/readable.h"
#include "vdb/test_files.h"

namespace esvr {
namespace {

using Bytes = std::vector<std::byte>;
using testing::HasSubstr;
using testing::ThrowsMessage;

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
    return test::bytesOf(path());
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

using namespace openvdb::io;
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
      for (std::size_t i = 0; i < whole.size(); i += i < kHead ? 3 : 1 + whole.size() / 400) {
        Bytes damaged = whole;
        damaged[i] ^= random() % 2 == 0 ? std::byte{0x80} : std::byte{0xff};
        refused += !readable(damaged);
      }
    }
  EXPECT_GT(refused, 500u);
}

TEST_F(Damage, EveryBitOfALeafMayBeWrong) {
  for (const auto compression : kEveryCodec) {
    test::saveCompressed(path(), {test::smallGrid()}, compression);
    const Bytes whole = test::bytesOf(path());
    // The last leaf's mask, packing, chunk size, chunk header and the first of its values.
    const std::size_t leafBytes = std::min<std::size_t>(whole.size(), compression ? 110 : 2200);
    for (std::size_t i = whole.size() - leafBytes; i < whole.size() - leafBytes + 110; ++i)
      for (int bit = 0; bit < 8; ++bit) {
        Bytes damaged = whole;
        damaged[i] ^= std::byte(1 << bit);
        (void)readable(damaged);
      }
  }
}

// A leaf's mask is in the file twice, the second time before its values.
TEST_F(Damage, ALeafWithoutTheActiveVoxelsOfItsTreeIsRefused) {
  test::saveCompressed(path(), {test::smallGrid()}, COMPRESS_NONE);
  Bytes bytes = test::bytesOf(path());
  constexpr std::size_t kPacking = 1;
  const std::size_t mask =
      bytes.size() - kBrickVoxels * sizeof(float) - kPacking - sizeof(BrickMask);
  std::fill_n(bytes.begin() + std::ptrdiff_t(mask), sizeof(BrickMask), std::byte{0});
  test::writeBytes(path(), bytes);
  EXPECT_THAT([&] { (void)readGrid(path(), "density"); },
              ThrowsMessage<BadInput>(HasSubstr("two different masks")));
}

TEST_F(Damage, ANegativeChunkSizeDoesNotOverrunTheLeaf) {
  test::saveCompressed(path(), {test::smallGrid()}, COMPRESS_ZIP | COMPRESS_ACTIVE_MASK);
  auto grid = test::smallGrid();
  grid->setGridClass(openvdb::GRID_UNKNOWN);
  test::saveCompressed(path(), {grid}, COMPRESS_ZIP | COMPRESS_ACTIVE_MASK);
  const Bytes whole = test::bytesOf(path());
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
  const Bytes whole = test::bytesOf(path());
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
  const Bytes whole = test::bytesOf(path());
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
              ThrowsMessage<BadInput>(HasSubstr("frustum within a frustum")));
}

TEST_F(Damage, RealFilesCutOrAlteredDoNoHarm) {
  ESVR_NEEDS_DATA();
  std::mt19937 random(1);
  for (const char* name : {"edge/background_one.vdb", "edge/three_grids_named_density.vdb",
                           "dragon_with_xform.vdb", "aneurism.vdb", "edge/double_grid.vdb"}) {
    const Bytes whole = test::bytesOf(test::dataDir() / name);
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
