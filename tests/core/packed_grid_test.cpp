// Plan: an image is packed whose every voxel is known, in several orders of its axes, and its bricks are
// compared with the definition: a voxel is active if it is not below the threshold, or differs from the
// background.

#include "esvr/packed_grid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>

#include "esvr/error.h"

namespace esvr {
namespace {

constexpr Coord kSize{11, 9, 17};

std::size_t count() { return std::size_t(kSize.x) * kSize.y * kSize.z; }

template <class T>
T expected(Coord v) {
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
struct Image {
  explicit Image(std::array<int, 3> order) : voxels(new T[count()]) {
    const std::array side{kSize.x, kSize.y, kSize.z};
    std::ptrdiff_t step = 1;
    for (const int axis : order) {
      strides[std::size_t(axis)] = step;
      step *= side[std::size_t(axis)];
    }
    forEachVoxel([&](Coord v) { at(v) = expected<T>(v); });
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
    const auto value = expected<int>(v);
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
    expectVoxels(packedOf<float>(Image<std::uint8_t>(order).box(), 0.0f, {.threshold = 30.0}),
                 [](int value) { return value >= 30; });
    expectVoxels(packedOf<float>(Image<float>(order).box(), 5.0f, {}),
                 [](int value) { return value != 5; });
  }
}

TEST(PackedGrid, ordersBricksAndKeepsTheValuesOfSlabs) {
  const Image<std::int16_t> image({0, 1, 2});
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
  const Image<std::uint8_t> image({0, 1, 2});
  const auto count = [&](double threshold) {
    return voxelsOf(packedOf<float>(image.box(), 0.0f, {.threshold = threshold})).size();
  };
  EXPECT_EQ(count(29.5), count(30.0));
  EXPECT_EQ(count(-1.0), kSize.x * kSize.y * kSize.z);
  EXPECT_EQ(count(-1e300), kSize.x * kSize.y * kSize.z);
  EXPECT_EQ(count(256.0), 0u);
  EXPECT_EQ(count(1e300), 0u);
  EXPECT_EQ(voxelsOf(packedOf<float>(image.box(), 0.5f, {})).size(), kSize.x * kSize.y * kSize.z)
      << "no whole number equals the background";
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
  const Image<float> image({0, 1, 2});
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
  const Image<float> image({0, 1, 2});
  const auto voxels = packedOf<float>(image.box(), 5.0f, {});
  const SparseVolume volume = unpacked(voxels);
  forEachVoxel([&](Coord v) { ASSERT_EQ(valueAt(volume, v), expected<float>(v)); });
  EXPECT_EQ(voxelsOf(packed(volume)), voxelsOf(voxels));
  const PackedGrid grid{{}, voxels};
  EXPECT_EQ(activeVoxelCount(grid), activeVoxelCount(volume));
  EXPECT_EQ(activeBox(grid), activeBox(volume));
  EXPECT_EQ(valueTypeOf(grid), "float");
}

}  // namespace
}  // namespace esvr
