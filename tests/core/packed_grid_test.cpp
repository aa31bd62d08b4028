// Plan: an image is packed whose every voxel is known, in several orders of its axes, as a whole and in slabs,
// and its bricks are compared with the definition: a voxel is active if it is not below the threshold, or
// differs from the background.

#include "esvr/grid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "esvr/error.h"

namespace esvr {
namespace {

constexpr Coord kSize{11, 9, 17};

std::size_t voxelCount() { return std::size_t(kSize.x) * kSize.y * kSize.z; }

template <class T>
T expectedValue(Coord v) {
  return T((v.x + 3 * v.y + 7 * v.z) % 40);
}

/// Calls visit for all voxels.
template <class Visit>
void forEachVoxel(const Visit& visit) {
  for (int x = 0; x < kSize.x; ++x)
    for (int y = 0; y < kSize.y; ++y)
      for (int z = 0; z < kSize.z; ++z) visit(Coord{x, y, z});
}

/// The voxels with the first of these axes fastest.
template <class T>
struct TestImage {
  explicit TestImage(std::array<int, 3> order) : voxels(new T[voxelCount()]) {
    const std::array side{kSize.x, kSize.y, kSize.z};
    std::ptrdiff_t step = 1;
    for (const int axis : order) {
      strides[std::size_t(axis)] = step;
      step *= side[std::size_t(axis)];
    }
    forEachVoxel([&](Coord v) { at(v) = expectedValue<T>(v); });
  }
  T& at(Coord v) { return voxels[strides[0] * v.x + strides[1] * v.y + strides[2] * v.z]; }
  [[nodiscard]] ImageBox<T> box() const { return {voxels.get(), strides, {}, kSize}; }

  std::unique_ptr<T[]> voxels;
  std::array<std::ptrdiff_t, 3> strides{};
};

template <class T, class Source>
PackedVoxels<T> packedOf(const ImageBox<Source>& box, T background, const PackingRule& rule) {
  GridPacker<T> packer(background, rule);
  packer.template add<Source>(std::span(&box, 1));
  return packer.finish();
}

/// The active voxels by their coordinates.
template <class T>
std::map<Coord, T> voxelsOf(const PackedVoxels<T>& voxels) {
  std::map<Coord, T> all;
  for (std::size_t b = 0; b < voxels.bricks.size(); ++b)
    for (int i = 0, n = 0; i < kBrickVoxels; ++i)
      if (voxels.bricks[b].active.test(i))
        all[voxels.bricks[b].corner + voxelLocal(i)] = voxels.value(b, n++);
  return all;
}

template <class T, class IsActive>
void expectVoxels(const PackedVoxels<T>& voxels, const IsActive& isActive) {
  const auto all = voxelsOf(voxels);
  std::size_t active = 0;
  forEachVoxel([&](Coord v) {
    const auto value = expectedValue<int>(v);
    const auto at = all.find(v);
    ASSERT_EQ(at != all.end(), isActive(value)) << toString(v);
    if (at == all.end()) return;
    ++active;
    ASSERT_EQ(double(at->second), double(value)) << toString(v);
  });
  EXPECT_EQ(all.size(), active) << "no voxel lies outside the image";
}

TEST(PackedGrid, hasTheVoxelsOfAnImageInAnyOrderOfItsAxes) {
  for (const std::array<int, 3> order :
       {std::array{0, 1, 2}, std::array{2, 1, 0}, std::array{1, 2, 0}}) {
    expectVoxels(packedOf<float>(TestImage<std::uint8_t>(order).box(), 0.0f, {.threshold = 30.0}),
                 [](int value) { return value >= 30; });
    expectVoxels(packedOf<float>(TestImage<float>(order).box(), 5.0f, {}),
                 [](int value) { return value != 5; });
  }
}

TEST(PackedGrid, ordersBricksAndKeepsTheValuesOfSlabs) {
  const TestImage<std::int16_t> image({0, 1, 2});
  GridPacker<float> packer(0.0f, {});
  for (const int z : {16, 0, 8}) {
    ImageBox<std::int16_t> slab = image.box();
    slab.corner.z = z;
    slab.voxels += image.strides[2] * z;
    slab.size.z = std::min(8, kSize.z - z);
    packer.add<std::int16_t>(std::span(&slab, 1));
  }
  const auto voxels = packer.finish();
  EXPECT_TRUE(std::ranges::is_sorted(voxels.bricks, {}, &PackedBrick::corner));
  expectVoxels(voxels, [](int value) { return value != 0; });
}

TEST(PackedGrid, comparesTheThresholdInTheTypeOfTheImage) {
  const TestImage<std::uint8_t> image({0, 1, 2});
  const auto activeFrom = [&](double threshold) {
    return voxelsOf(packedOf<float>(image.box(), 0.0f, {.threshold = threshold})).size();
  };
  EXPECT_EQ(activeFrom(29.5), activeFrom(30.0));
  EXPECT_GT(activeFrom(29.0), activeFrom(29.5));
  EXPECT_EQ(activeFrom(-1.0), voxelCount());
  EXPECT_EQ(activeFrom(-1e300), voxelCount());
  EXPECT_EQ(activeFrom(256.0), 0u);
  EXPECT_EQ(activeFrom(1e300), 0u);
  EXPECT_EQ(voxelsOf(packedOf<float>(image.box(), 0.5f, {})).size(), voxelCount())
      << "no whole number equals the background";
}

TEST(PackedGrid, roundsNoFloatUpToAThresholdBetweenFloats) {
  const float below = 0.1f, above = std::nextafter(below, 1.0f);  // 0.1f is above 0.1
  const float values[] = {std::nextafter(below, 0.0f), below, above, std::nanf("")};
  const ImageBox<float> box{values, {1, 4, 4}, {}, {4, 1, 1}};
  EXPECT_EQ(voxelsOf(packedOf<float>(box, 0.0f, {.threshold = 0.1})).size(), 2u);
  EXPECT_EQ(voxelsOf(packedOf<float>(box, 0.0f, {.threshold = double(below) + 1e-12})).size(), 1u);
  EXPECT_EQ(voxelsOf(packedOf<float>(box, 0.0f, {})).size(), 4u) << "NaN differs from all numbers";
  EXPECT_EQ(voxelsOf(packedOf<double>(box, 0.1, {})).size(), 4u) << "0.1f is not 0.1";
  EXPECT_EQ(voxelsOf(packedOf<double>(box, double(below), {})).size(), 3u);
}

TEST(PackedGrid, keepsAllBitsOfIntegers) {
  const std::int64_t values[] = {9007199254740993, -9223372036854775807, 9223372036854775807, 0};
  const ImageBox<std::int64_t> box{values, {1, 4, 4}, {-8, 0, 0}, {4, 1, 1}};
  const auto voxels = voxelsOf(packedOf<std::int64_t>(box, std::int64_t{0}, {}));
  EXPECT_EQ(voxels.size(), 3u);
  for (int x = 0; x < 3; ++x) EXPECT_EQ(voxels.at({x - 8, 0, 0}), values[x]);
  EXPECT_EQ(
      voxelsOf(packedOf<std::int64_t>(box, std::int64_t{0}, {.threshold = 9223372036854775808.0}))
          .size(),
      0u);
  EXPECT_EQ(voxelsOf(packedOf<std::int64_t>(box, std::int64_t{9007199254740992}, {})).size(), 4u)
      << "the background is compared as an integer";
  const std::uint8_t small[] = {3, 255};
  const ImageBox<std::uint8_t> smallBox{small, {1, 2, 2}, {}, {2, 1, 1}};
  EXPECT_EQ(voxelsOf(packedOf<std::int32_t>(smallBox, 3, {})).size(), 1u);
  EXPECT_EQ(voxelsOf(packedOf<std::int32_t>(smallBox, 259, {})).size(), 2u)
      << "the type of the image does not hold the background";
}

TEST(PackedGrid, hasOnlyTrueVoxelsOfAMask) {
  const bool values[] = {true, false, true, false}, active[] = {true, true, false, false};
  ImageBox<bool> box{values, {1, 4, 4}, {}, {4, 1, 1}};
  EXPECT_EQ(voxelsOf(packedOf<bool>(box, false, {})).size(), 2u);
  box.active = active;
  box.activeStrides = box.strides;
  EXPECT_EQ(voxelsOf(packedOf<bool>(box, false, {})), (std::map<Coord, bool>{{{0, 0, 0}, true}}));
}

TEST(PackedGrid, takesTheActiveVoxelsThatAreGivenAndVectors) {
  const float components[] = {1, 2, 3, 0, 0, 0};
  std::vector<ImageBox<float>> boxes;
  for (int c = 0; c < 3; ++c) boxes.push_back({components + c, {3, 6, 6}, {}, {2, 1, 1}});
  GridPacker<PackedVector> packer({}, {});
  packer.add<float>(boxes);
  const auto voxels = voxelsOf(packer.finish());
  ASSERT_EQ(voxels.size(), 1u);
  EXPECT_EQ(voxels.at({0, 0, 0}), (PackedVector{1, 2, 3}));

  const bool active[] = {false, true};
  for (auto& box : boxes) {
    box.active = active;
    box.activeStrides = {1, 2, 2};
  }
  packer.add<float>(boxes);
  EXPECT_EQ(voxelsOf(packer.finish()).at({1, 0, 0}), PackedVector{});
}

TEST(PackedGrid, refusesBoxesThatOverlapOrBeginWithinABrickAndTooMuchMemory) {
  const TestImage<float> image({0, 1, 2});
  ImageBox<float> box = image.box();
  GridPacker<float> packer(0.0f, {});
  packer.add<float>(std::span(&box, 1));
  packer.add<float>(std::span(&box, 1));
  EXPECT_THROW((void)packer.finish(), UsageError);
  box.corner.y = 4;
  EXPECT_THROW(packer.add<float>(std::span(&box, 1)), UsageError);
  EXPECT_THROW((void)packedOf<float>(image.box(), 0.0f, {.maxBytes = 5000}), MemoryExceeded);
}

TEST(PackedGrid, becomesAVolumeAndComesBack) {
  const TestImage<float> image({0, 1, 2});
  const auto voxels = packedOf<float>(image.box(), 5.0f, {});
  const SparseVolume volume = unpacked(voxels);
  forEachVoxel([&](Coord v) { ASSERT_EQ(valueAt(volume, v), expectedValue<float>(v)); });
  GridDescriptor descriptor;
  descriptor.name = "a";
  const PackedGrid grid = packed(descriptor, volume);
  EXPECT_EQ(voxelsOf(std::get<PackedVoxels<float>>(grid.voxels)), voxelsOf(voxels));
  EXPECT_EQ(grid.descriptor.name, "a");
  EXPECT_EQ(activeVoxelCount(grid), activeVoxelCount(volume));
  EXPECT_EQ(activeBox(grid), activeBox(volume));
  EXPECT_EQ(valueTypeOf(grid), "float");

  descriptor.valueType = ValueType::kDouble;
  descriptor.background = 0.1;
  const PackedGrid wide = packed(descriptor, volume);
  EXPECT_EQ(valueTypeOf(wide), "double");
  EXPECT_EQ(std::get<PackedVoxels<double>>(wide.voxels).background, 0.1);
}

TEST(PackedGrid, withoutAnActiveVoxelHasAnEmptyBox) {
  const PackedGrid grid{{}, PackedVoxels<std::int32_t>{}};
  EXPECT_EQ(activeVoxelCount(grid), 0u);
  EXPECT_TRUE(activeBox(grid).empty());
  EXPECT_EQ(unpacked({}).brickCount(), 0u);
}

}  // namespace
}  // namespace esvr
