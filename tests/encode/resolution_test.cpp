// Plan: decoded grids are averaged at whole and at other factors, and compared with the definition in float64: the mean of
// valueAt() over the space of each coarse voxel, by its parts. This is done for voxels and ellipsoids, with a tone curve,
// a far background, missing values and level sets, and in pieces that are smaller than the grid. A linear function of the
// world keeps its values through the transform of a coarser grid, which shows that voxels do not move. Finer ellipsoids
// have the values of evaluatePlaces() at the same places of the world.

#include "esvr/resolution.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "../fit/volumes.h"
#include "esvr/encode.h"
#include "esvr/error.h"
#include "esvr/vdb_io.h"
#include "support/non_finite.h"

namespace esvr {
namespace {

using test::kInf;
using test::kNan;
using testing::HasSubstr;
using testing::ThrowsMessage;

GridDescriptor descriptorOf(float background = 0.0f) {
  GridDescriptor descriptor;
  descriptor.name = "density";
  descriptor.background = background;
  descriptor.transform = affineTransform({0.5, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 0.5, 0, 3, -2, 1, 1});
  return descriptor;
}

StoredGrid exactOf(const SparseVolume& volume, GridDescriptor descriptor) {
  return makeStoredVoxels(std::move(descriptor), volume, exactLayer(volume));
}
StoredGrid exactOf(const SparseVolume& volume) {
  return exactOf(volume, descriptorOf(volume.background));
}

/// The definition of an average over the space of coarse voxel c.
struct Expected {
  double sum = 0.0, volume = 0.0, missing = 0.0;
  bool isActive = false;
  [[nodiscard]] double mean() const { return sum / volume; }
};

Expected averageAt(const SparseVolume& fine, Coord c, double r, bool onlyActive = false) {
  Expected e;
  const auto part = [&](int voxel, int coarse) {
    return std::max(0.0,
                    std::min(voxel + 1.0, (coarse + 1) * r) - std::max(double(voxel), coarse * r));
  };
  const auto first = [&](int coarse) { return int(std::floor(coarse * r)); };
  const auto last = [&](int coarse) { return int(std::ceil((coarse + 1) * r)) - 1; };
  for (int x = first(c.x); x <= last(c.x); ++x)
    for (int y = first(c.y); y <= last(c.y); ++y)
      for (int z = first(c.z); z <= last(c.z); ++z) {
        const double volume = part(x, c.x) * part(y, c.y) * part(z, c.z);
        if (volume <= 0.0) continue;
        const Coord at{x, y, z};
        const auto b = findBrick(fine, brickOf(at) - brickOf(fine.origin));
        const bool isActive = b && fine.active[*b].test(voxelOffset(localOf(at)));
        const double value = valueAt(fine, at);
        e.isActive = e.isActive || isActive;
        if (!std::isfinite(value)) {
          e.missing += volume;
        } else if (isActive || !onlyActive) {
          e.sum += volume * value;
          e.volume += volume;
        }
      }
  return e;
}

/// Compares all voxels of a coarse volume, and those around it, with the definition.
void expectAverages(const SparseVolume& fine, const SparseVolume& coarse, double r,
                    bool onlyActive = false) {
  checkInvariants(coarse);
  ASSERT_GT(activeVoxelCount(coarse), 0u);
  const Box box = activeBox(fine);
  double scale = 0.0;
  for (const float value : fine.values)
    if (std::isfinite(value)) scale = std::max(scale, std::abs(double(value)));
  std::uint64_t active = 0;
  const auto at = [&](int voxel) { return int(std::floor(voxel / r)); };
  for (int x = at(box.min.x) - 1; x <= at(box.max.x) + 1; ++x)
    for (int y = at(box.min.y) - 1; y <= at(box.max.y) + 1; ++y)
      for (int z = at(box.min.z) - 1; z <= at(box.max.z) + 1; ++z) {
        const Coord c{x, y, z};
        const Expected e = averageAt(fine, c, r, onlyActive);
        const float made = valueAt(coarse, c);
        active += e.isActive;
        if (!e.isActive) {
          ASSERT_EQ(std::abs(made), std::abs(coarse.background)) << toString(c);
        } else if (e.volume == 0.0) {
          ASSERT_TRUE(std::isnan(made)) << toString(c);
        } else {
          // Sums in double; the result is rounded to float.
          ASSERT_NEAR(made, e.mean(), 1e-7 * scale) << toString(c) << " of factor " << r;
        }
      }
  EXPECT_EQ(activeVoxelCount(coarse), active);
}

SparseVolume soft(float background = 0.0f, float base = 0.0f) {
  return test::volumeOf({-16, 8, 0}, 4, background, [&](Coord v) {
    const double r2 = std::pow(v.x, 2) + std::pow(v.y - 22, 2) + std::pow(v.z - 15, 2);
    return r2 < 150.0 ? base + float(2.0 - r2 / 100.0) : background;
  });
}

TEST(Coarser, VoxelsAreAverages) {
  const SparseVolume fine = soft();
  for (const double r : {2.0, 4.0, 8.0, 3.0, 1.5, 2.7, 40.0})
    expectAverages(fine, decodeAtResolution(exactOf(fine), r).volume, r);
}

TEST(Coarser, OfABackgroundOtherThanZero) {
  const SparseVolume fine = soft(1.25f);
  expectAverages(fine, decodeAtResolution(exactOf(fine), 2.0).volume, 2.0);
}

TEST(Coarser, LeavesAFarBackgroundOut) {
  const SparseVolume fine = soft(0.0f, 280.0f);
  const SparseVolume coarse = decodeAtResolution(exactOf(fine), 4.0).volume;
  expectAverages(fine, coarse, 4.0, true);
  EXPECT_GT(activeRange(coarse).min, 279.0f);
}

TEST(Coarser, EllipsoidsAreAveragesOfTheirVoxels) {
  const SparseVolume source = soft();
  ConvertOptions options;
  options.goal = FitGoal{};
  options.representation = Representation::kEllipsoids;
  options.fit.count = 20;
  options.fit.iterations = 40;
  for (const auto activity : {Activity::kByValue, Activity::kExact})
    for (const float tone : {0.0f, 0.3f}) {
      options.storage.activity = activity;
      options.tone = ToneCurve{tone};
      const StoredGrid grid = convertVolume({descriptorOf(), source}, options).grid;
      ASSERT_GT(grid.field.ellipsoidCount(), 0u);
      for (const double r : {2.0, 3.5})
        expectAverages(decodeGrid(grid), decodeAtResolution(grid, r).volume, r);
    }
}

TEST(Coarser, VolumesBecomeWhatTheirGridsDo) {
  const SparseVolume volume = soft(0.0f, 0.25f);
  const SparseVolume expected = decodeAtResolution(exactOf(volume), 2.0).volume;
  const SparseVolume coarse = coarsened(volume, 2);
  EXPECT_EQ(coarse.origin, expected.origin);
  EXPECT_EQ(coarse.bricks, expected.bricks);
  EXPECT_EQ(coarse.values, expected.values);
  EXPECT_EQ(coarse.active, expected.active);
}

TEST(Coarser, LeavesMissingValuesOut) {
  SparseVolume fine = soft();
  for (std::size_t n = 0; n < fine.values.size(); n += 3)
    if (fine.active[n / kBrickVoxels].test(int(n % kBrickVoxels)))
      fine.values[n] = n % 2 == 0 ? kNan : kInf;
  for (int v = 0; v < kBrickVoxels; ++v)  // a whole brick
    if (fine.active[20].test(v)) fine.brickValues(20)[std::size_t(v)] = kNan;
  ConvertOptions options;
  options.goal = LosslessGoal{};
  const StoredGrid grid = convertVolume({descriptorOf(), fine}, options).grid;
  for (const double r : {2.0, 4.0, 3.0})
    expectAverages(fine, decodeAtResolution(grid, r).volume, r);
}

TEST(Coarser, KeepsTheSidesOfALevelSet) {
  const SparseVolume fine = test::levelSetVolume();
  GridDescriptor descriptor = descriptorOf(fine.background);
  descriptor.gridClass = GridClass::kLevelSet;
  const SparseVolume coarse = decodeAtResolution(exactOf(fine, descriptor), 2.0).volume;
  EXPECT_TRUE(EmptySigns(coarse).agree());
  for (int x = 0; x < 24; ++x) {
    const Coord c{x, 11, 12};
    // Its center is voxel 2 c + 0.5 of the source, and that of the ball 23.5.
    const double distance = std::hypot(2.0 * x - 23.0, -1.0, 1.0) - 19.0;
    if (std::abs(distance) < 1.5) {
      EXPECT_NEAR(valueAt(coarse, c), distance, 0.2) << x;
    }
    const bool hasBrick = findBrick(coarse, brickOf(c) - brickOf(coarse.origin)).has_value();
    if (hasBrick) {
      EXPECT_EQ(valueAt(coarse, c) < 0.0f, distance < 0.0) << x;
    }
  }
}

TEST(Coarser, DoesNotDependOnTheBoxOfTheWork) {
  // More bricks than are decoded or made at once.
  const SparseVolume fine = test::volumeOf(
      {}, 14, 0.0f, [](Coord v) { return float((v.x * 7 + v.y * 3 + v.z) % 31) + 1.0f; });
  for (const double factor : {2.0, 8.0})
    expectAverages(fine, decodeAtResolution(exactOf(fine), factor).volume, factor);
  const Box box{{0, 0, 0}, {15, 15, 15}};
  const SparseVolume part = decodeAtResolution(exactOf(fine), 2.0, {.box = box}).volume;
  EXPECT_EQ(activeVoxelCount(part), 512u);
}

TEST(Coarser, IsRefusedBeforeItExceedsTheMemory) {
  const StoredGrid grid = exactOf(soft());
  EXPECT_THROW((void)decodeAtResolution(grid, 2.0, {.maxBytes = 1000}), MemoryExceeded);
  EXPECT_LT(bytesAtResolution(grid, 4.0).result, bytesAtResolution(grid, 2.0).result);
  EXPECT_LT(bytesAtResolution(grid, 2.0).result, bytesAtResolution(grid, 1.0).result);
}

TEST(Coarser, VoxelsStayInTheirPlaceInTheWorld) {
  // The values are a linear function of the world, which averages keep.
  const GridDescriptor descriptor = descriptorOf(-1e3f);
  const auto world = [](const Transform& t, double x, double y, double z, std::size_t axis) {
    const auto& m = *t.affine;
    return x * m[axis] + y * m[4 + axis] + z * m[8 + axis] + m[12 + axis];
  };
  const auto linear = [&](const Transform& t, double x, double y, double z) {
    return 100.0 + world(t, x, y, z, 0) + 10.0 * world(t, x, y, z, 1) - 3.0 * world(t, x, y, z, 2);
  };
  const SparseVolume fine = test::volumeOf({-8, 0, 0}, 3, -1e3f, [&](Coord v) {
    return float(linear(descriptor.transform, v.x, v.y, v.z));
  });
  for (const double r : {2.0, 4.0, 3.0}) {
    const VolumeGrid coarse = decodeAtResolution(exactOf(fine, descriptor), r);
    EXPECT_EQ(coarse.descriptor.transform.mapType, "UniformScaleTranslateMap");
    const Coord c{1, 1, 1};  // wholly inside
    EXPECT_NEAR(valueAt(coarse.volume, c), linear(coarse.descriptor.transform, c.x, c.y, c.z),
                1e-4);
  }
  const Transform twice = transformAt(descriptor.transform, 2.0);
  EXPECT_DOUBLE_EQ((*twice.affine)[0], 1.0);
  EXPECT_DOUBLE_EQ((*twice.affine)[12], 3.25);  // half a voxel of the source
  EXPECT_EQ(factorFor(descriptor.transform, 1.0), 2.0);
  EXPECT_EQ(factorFor(descriptor.transform, 0.1 * 15.0), 3.0);
}

TEST(Resolution, OfAFrustumAndFactorsOutOfRangeAreRefused) {
  Transform frustum{.mapType = "NonlinearFrustumMap", .map = {}, .affine = {}};
  EXPECT_THROW((void)transformAt(frustum, 2.0), UsageError);
  EXPECT_EQ(transformAt(frustum, 1.0), frustum);
  EXPECT_THROW((void)factorFor(frustum, 1.0), UsageError);
  for (const double factor : {0.0, -1.0, 2000.0, std::nan("")})
    EXPECT_THROW((void)transformAt(descriptorOf().transform, factor), UsageError);
}

/// Twenty ellipsoids that are fitted to soft().
StoredGrid softEllipsoids() {
  ConvertOptions options;
  options.goal = FitGoal{};
  options.representation = Representation::kEllipsoids;
  options.fit.count = 20;
  options.fit.iterations = 40;
  return convertVolume({descriptorOf(), soft()}, options).grid;
}

TEST(Finer, EllipsoidsAreEvaluatedBetweenVoxels) {
  const StoredGrid grid = softEllipsoids();
  for (const double r : {0.5, 0.4}) {
    const VolumeGrid finer = decodeAtResolution(grid, r);
    std::vector<Place> places;
    std::vector<float> values;
    for (std::size_t n = 0; n < finer.volume.values.size(); n += 97) {
      if (!finer.volume.active[n / kBrickVoxels].test(int(n % kBrickVoxels))) continue;
      const Coord c =
          finer.volume.brickCorner(n / kBrickVoxels) + voxelLocal(int(n % kBrickVoxels));
      places.push_back({r * (c.x + 0.5) - 0.5, r * (c.y + 0.5) - 0.5, r * (c.z + 0.5) - 0.5});
      values.push_back(finer.volume.values[n]);
    }
    ASSERT_GT(places.size(), 100u);
    std::vector<float> expected(places.size());
    evaluatePlaces(grid.field, places, expected);
    const auto range = *voxelRule(grid).range;
    // Both are within 4e-6 of the sum of the magnitudes of the intensities, of which 20 are at most about 3.
    for (std::size_t i = 0; i < places.size(); ++i)
      EXPECT_NEAR(values[i], std::clamp(expected[i], range.min, range.max), 5e-4);
    const double volume = std::pow(r, 3) * double(activeVoxelCount(finer.volume));
    EXPECT_NEAR(volume / double(activeVoxelCount(decodeGrid(grid))), 1.0, 0.05);
  }
}

TEST(Field, AmongOtherVoxelsHasItsValuesAtTheSamePlaces) {
  const Field field = softEllipsoids().field;
  std::vector<Place> places;
  for (int n = 0; n < 200; ++n) places.push_back({0.17 * n, 24.0 - 0.11 * n, 5.0 + 0.07 * n});
  std::vector<float> expected(places.size()), values(places.size());
  evaluatePlaces(field, places, expected);
  EXPECT_GT(*std::ranges::max_element(expected), 0.1f);
  for (const double r : {2.0, 0.5}) {
    std::vector<Place> others;
    for (const auto& [x, y, z] : places)
      others.push_back({(x + 0.5) / r - 0.5, (y + 0.5) / r - 0.5, (z + 0.5) / r - 0.5});
    evaluatePlaces(amongOtherVoxels(field, r), others, values);
    // As above; the logarithms of scales are rounded to 2e-7 of themselves.
    for (std::size_t i = 0; i < places.size(); ++i) EXPECT_NEAR(values[i], expected[i], 5e-4);
  }
}

TEST(Finer, VoxelsAndMasksAreRefusedByName) {
  EXPECT_THAT([] { (void)decodeAtResolution(exactOf(soft()), 0.5); },
              ThrowsMessage<UsageError>(HasSubstr("grid 'density' cannot become finer")));
}

}  // namespace
}  // namespace esvr
