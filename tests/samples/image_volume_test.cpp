// Plan: a dense image in memory becomes a volume by the stated rules, voxel by voxel. The tests
// check every raw type and byte order, NRRD headers and transforms, and refused files.

#include "images/image_volume.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "cli/run_program.h"
#include "esvr/error.h"
#include "generators/hash_noise.h"
#include "samples/whole_image.h"

namespace esvr::samples {
namespace {

using test::TemporaryFolder;
using testing::HasSubstr;
using testing::ThrowsMessage;

class MemoryImage : public ImageSource {
 public:
  MemoryImage(Coord size, std::vector<float> values) : size_(size), values_(std::move(values)) {}

  [[nodiscard]] Coord size() const override { return size_; }
  [[nodiscard]] std::optional<double> typeMaximum() const override { return maximum; }
  [[nodiscard]] std::array<double, 16> indexToWorld() const override { return {}; }
  void read(const Slab& slab, std::span<float> out) override {
    const auto first = std::size_t(slab.firstZ) * std::size_t(size_.x) * std::size_t(size_.y);
    std::copy_n(values_.begin() + std::ptrdiff_t(first), out.size(), out.begin());
  }
  [[nodiscard]] float at(Coord v) const {
    return values_[std::size_t((v.z * size_.y + v.y) * size_.x + v.x)];
  }

  std::optional<double> maximum;

 private:
  Coord size_;
  std::vector<float> values_;
};

MemoryImage noisyImage(Coord size) {
  Random random(1);
  std::vector<float> values(std::size_t(size.x) * std::size_t(size.y) * std::size_t(size.z));
  for (float& value : values) value = std::floor(float(random.uniform(0.0, 8.0)));
  return {size, values};
}

struct Expected {
  double threshold, background, scale;
};

void expectEveryVoxel(const SparseVolume& volume, const MemoryImage& image, const Expected& e) {
  std::uint64_t active = 0;
  for (int x = 0; x < image.size().x; ++x)
    for (int y = 0; y < image.size().y; ++y)
      for (int z = 0; z < image.size().z; ++z) {
        const bool kept = image.at({x, y, z}) >= e.threshold;
        active += kept;
        const double value = kept ? double(image.at({x, y, z})) : e.background;
        ASSERT_EQ(valueAt(volume, {x, y, z}), float(value * e.scale)) << x << ' ' << y << ' ' << z;
      }
  EXPECT_EQ(activeVoxelCount(volume), active);
  EXPECT_EQ(volume.background, float(e.background * e.scale));
  EXPECT_NO_THROW(checkInvariants(volume));
}

TEST(VolumeOf, keepsWhatIsNotBelowTheThreshold) {
  auto image = noisyImage({13, 9, 20});
  const auto made = volumeOf(image, {.threshold = 5.0}, {});
  expectEveryVoxel(made.volume, image, {5.0, 0.0, 1.0});
}

TEST(VolumeOf, withoutAThresholdKeepsWhatDiffersFromTheBackground) {
  MemoryImage image({3, 1, 1}, {2.0f, 0.0f, -1.0f});
  const auto made = volumeOf(image, {.background = 2.0}, {});
  EXPECT_EQ(activeVoxelCount(made.volume), 2u);
  EXPECT_EQ(valueAt(made.volume, {2, 0, 0}), -1.0f);
  EXPECT_EQ(valueAt(made.volume, {-5, 0, 0}), 2.0f);
}

TEST(VolumeOf, normalisesIntegersByTheirTypeAndFloatsByTheirLargest) {
  auto image = noisyImage({8, 8, 8});
  image.maximum = 255.0;
  expectEveryVoxel(
      volumeOf(image, {.threshold = 2.0, .background = 1.0, .normalise = true}, {}).volume, image,
      {2.0, 1.0, 1.0 / 255.0});
  image.maximum.reset();
  expectEveryVoxel(volumeOf(image, {.threshold = 2.0, .normalise = true}, {}).volume, image,
                   {2.0, 0.0, 1.0 / 7.0});
}

TEST(VolumeOf, refusesOrZeroesWhatIsNotFinite) {
  std::vector<float> values(2 * 2 * 12, 1.0f);
  values[4 * 9 + 3] = std::numeric_limits<float>::quiet_NaN();
  values[4 * 10] = std::numeric_limits<float>::infinity();
  MemoryImage image({2, 2, 12}, values);
  EXPECT_THAT(
      [&] { (void)volumeOf(image, {}, {}); },
      ThrowsMessage<BadInput>(testing::AllOf(HasSubstr("2 voxels"), HasSubstr("(1, 1, 9)"))));
  const auto made = volumeOf(image, {.zeroNonFinite = true}, {});
  EXPECT_EQ(made.nonFiniteReplaced, 2u);
  EXPECT_EQ(valueAt(made.volume, {1, 1, 9}), 0.0f);
  EXPECT_EQ(activeVoxelCount(made.volume), 46u);
}

TEST(VolumeOf, refusesToNormaliseNothing) {
  MemoryImage image({2, 2, 2}, std::vector<float>(8, 0.0f));
  EXPECT_THROW((void)volumeOf(image, {.normalise = true}, {}), BadInput);
}

TEST(VolumeOf, stopsAtItsLimits) {
  auto image = noisyImage({64, 64, 64});
  EXPECT_THROW((void)volumeOf(image, {}, {.maxBricks = 20}), DeviceError);
  CancelToken token;
  token.cancel();
  EXPECT_THROW((void)volumeOf(image, {}, {.cancel = &token}), Cancelled);
}

template <class T>
void expectRawReads(const char* type, std::optional<double> maximum) {
  const std::vector<T> values{
      T(1), T(2), T(100), std::numeric_limits<T>::lowest(), std::numeric_limits<T>::max(), T(7)};
  for (const bool big : {false, true}) {
    const TemporaryFolder folder;
    test::writeText(folder / "a.raw", "head" + bytesOf(values, big));
    const auto image = openRaw(
        folder / "a.raw", {.size = {1, 2, 3}, .type = type, .bigEndian = big, .headerBytes = 4});
    EXPECT_EQ(image->typeMaximum(), maximum);
    std::vector<float> read(4);
    image->read({1, 2}, read);
    for (std::size_t i = 0; i < 4; ++i)
      EXPECT_EQ(read[i], float(values[i + 2])) << type << ' ' << i;
  }
}

TEST(OpenRaw, readsEveryTypeInBothByteOrders) {
  expectRawReads<std::uint8_t>("uint8", 255.0);
  expectRawReads<std::int8_t>("int8", 127.0);
  expectRawReads<std::uint16_t>("uint16", 65535.0);
  expectRawReads<std::int16_t>("int16", 32767.0);
  expectRawReads<std::uint32_t>("uint32", 4294967295.0);
  expectRawReads<std::int32_t>("int32", 2147483647.0);
  expectRawReads<std::uint64_t>("uint64", 18446744073709551615.0);
  expectRawReads<std::int64_t>("int64", 9223372036854775807.0);
  expectRawReads<float>("float32", std::nullopt);
}

TEST(OpenRaw, readsDoublesAsFloats) {
  const TemporaryFolder folder;
  test::writeText(folder / "a.raw", bytesOf(std::vector{0.1, -2.5}, false));
  const auto image = openRaw(folder / "a.raw", {.size = {2, 1, 1}, .type = "float64"});
  std::vector<float> read(2);
  image->read({0, 1}, read);
  EXPECT_EQ(read[0], 0.1f);
  EXPECT_EQ(read[1], -2.5f);
}

TEST(OpenRaw, refusesAFileOfAnotherLength) {
  const TemporaryFolder folder;
  test::writeText(folder / "a.raw", "12345");
  const auto open = [&](Coord size) {
    return [&folder, size] { (void)openRaw(folder / "a.raw", {.size = size, .type = "uint8"}); };
  };
  EXPECT_THAT(open({1, 2, 3}),
              ThrowsMessage<BadInput>(testing::AllOf(HasSubstr("5 bytes"), HasSubstr("need 6"))));
  EXPECT_THAT(open({1, 2, 2}), ThrowsMessage<BadInput>(HasSubstr("need 4")));
  EXPECT_THROW(open({2147483647, 2147483647, 2147483647})(), BadInput);
}

TEST(OpenRaw, refusesASizeOfNoVoxels) {
  const TemporaryFolder folder;
  test::writeText(folder / "a.raw", "12345");
  for (const Coord size : {Coord{0, 5, 1}, Coord{-1, -5, 1}, Coord{5, 1, -1}})
    EXPECT_THROW((void)openRaw(folder / "a.raw", {.size = size, .type = "uint8"}), UsageError);
}

TEST(OpenRaw, listsTheTypesThereAre) {
  EXPECT_THAT(
      [] {
        (void)openRaw("a.raw", {.size = {1, 1, 1}, .type = "ushort"});
      },
      ThrowsMessage<UsageError>(HasSubstr("uint16")));
}

constexpr const char* kNrrdHead = "NRRD0004\ntype: short\ndimension: 3\nsizes: 2 1 2\n";

TEST(OpenNrrd, readsAttachedBigEndianData) {
  const TemporaryFolder folder;
  const std::vector<std::int16_t> values{1, -2, 300, 4};
  test::writeText(folder / "a.nrrd", std::string(kNrrdHead) + "encoding: raw\nendian: big\n\n" +
                                         bytesOf(values, true));
  const auto image = openNrrd(folder / "a.nrrd");
  EXPECT_EQ(image->size(), (Coord{2, 1, 2}));
  EXPECT_EQ(image->typeMaximum(), 32767.0);
  std::vector<float> read(2);
  image->read({1, 1}, read);
  EXPECT_EQ(read, (std::vector<float>{300.0f, 4.0f}));
  EXPECT_EQ(image->indexToWorld()[0], 1.0);
}

TEST(OpenNrrd, readsDetachedTextDataAndItsPlaceInSpace) {
  const TemporaryFolder folder;
  test::writeText(folder / "a.txt", "1 2\n3 4\n");
  test::writeText(folder / "a.nhdr",
                  std::string(kNrrdHead) +
                      "encoding: text\nspace dimension: 3\n"
                      "space directions: (0,2,0) (-2,0,0) (0,0,0.5)\nspace origin: (10,20,30)\n"
                      "data file: a.txt\n");
  const auto image = openNrrd(folder / "a.nhdr");
  std::vector<float> read(4);
  image->read({0, 2}, read);
  EXPECT_EQ(read, (std::vector<float>{1, 2, 3, 4}));
  const std::array<double, 16> want{0, 2, 0, 0, -2, 0, 0, 0, 0, 0, 0.5, 0, 10, 20, 30, 1};
  EXPECT_EQ(image->indexToWorld(), want);
}

TEST(OpenNrrd, takesSpacingsWhereThereAreNoDirections) {
  const TemporaryFolder folder;
  test::writeText(folder / "a.nrrd",
                  std::string(kNrrdHead) + "spacings: 0.5 2 nan\nencoding: ascii\n\n1 2 3 4\n");
  const auto m = openNrrd(folder / "a.nrrd")->indexToWorld();
  EXPECT_EQ(m[0], 0.5);
  EXPECT_EQ(m[5], 2.0);
  EXPECT_EQ(m[10], 1.0);
}

struct BadNrrd {
  const char* text;
  const char* reason;
};

class RefusedNrrd : public testing::TestWithParam<BadNrrd> {};

TEST_P(RefusedNrrd, namesFileAndReason) {
  const TemporaryFolder folder;
  test::writeText(folder / "bad.nrrd", GetParam().text);
  EXPECT_THAT(
      [&] { (void)openNrrd(folder / "bad.nrrd"); },
      ThrowsMessage<BadInput>(testing::AllOf(HasSubstr("bad.nrrd"), HasSubstr(GetParam().reason))));
}

INSTANTIATE_TEST_SUITE_P(
    All, RefusedNrrd,
    testing::Values(
        BadNrrd{"", ""}, BadNrrd{"not an image\n", ""}, BadNrrd{"NRRD0004\ntype: short\n", ""},
        BadNrrd{"NRRD0004\ntype: uchar\ndimension: 2\nsizes: 2 2\nencoding: raw\n\n1234", "2 axes"},
        BadNrrd{"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: raw\n\n1234", ""},
        BadNrrd{"NRRD0004\ntype: double\ndimension: 3\nsizes: 100000 100000 100000\nencoding: "
                "raw\nendian: little\n\n1234",
                "memory"},
        BadNrrd{"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: raw\ndata file: "
                "none.raw\n",
                ""}));

TEST(OpenNrrd, refusesAFileThatIsNotThere) {
  EXPECT_THAT([] { (void)openNrrd("/nowhere/a.nrrd"); },
              ThrowsMessage<BadInput>(HasSubstr("/nowhere/a.nrrd")));
}

}  // namespace
}  // namespace esvr::samples
