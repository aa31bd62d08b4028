// Plan: a grid whose values follow from those of another one refers to it, and takes fewer bytes so;
// equal inputs have equal keys, and every property that a conversion depends on changes the key.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "../fit/volumes.h"
#include "encode/grids_of_file.h"
#include "encode/volumes.h"
#include "esvr/encode.h"
#include "esvr/error.h"
#include "esvr/grid_coding.h"

namespace esvr {
namespace {

using encode::chooseReference;
using encode::expectedFrom;

constexpr float kGain = 40.0f, kOffset = 300.0f;

StoredGrid boundedGrid(const SparseVolume& volume, double bound) {
  return makeStoredVoxels({}, volume, boundedLayer(volume, bound, Activity::kByValue));
}

/// A ball with soft values, times a gain, plus an offset, which is the background.
StoredGrid ball(float gain, float offset) {
  const SparseVolume volume = test::volumeOf({8, -16, 0}, 3, offset, [&](Coord v) {
    const double x = v.x - 18.0, y = v.y + 5.0, z = v.z - 12.0;
    const double value = 1.2 - std::sqrt(x * x + y * y + z * z) / 9.0;
    return float(std::max(value, 0.0)) * gain + offset;
  });
  return boundedGrid(volume, 0.01 * double(gain));
}

/// A tube, a density, a grid without voxels, and a temperature that is a map of the density.
std::vector<StoredGrid> grids() {
  return {boundedGrid(test::tubeVolume(), 0.01), ball(1.0f, 0.0f), StoredGrid{},
          ball(kGain, kOffset)};
}

TEST(ChooseReference, FindsTheGridAndTheMap) {
  const std::vector<std::size_t> candidates{0, 1, 2};
  const VoxelReference found = chooseReference(grids(), 3, candidates);
  EXPECT_EQ(found.grid, std::size_t{1});
  // The values of both grids are off by at most a hundredth of their range.
  EXPECT_NEAR(found.gain, kGain, 0.01f * kGain);
  EXPECT_NEAR(found.offset, kOffset, 0.01f * kGain);
}

TEST(ChooseReference, IsEmptyWithoutCandidates) {
  EXPECT_EQ(chooseReference(grids(), 3, {}), VoxelReference{});
  const std::vector<std::size_t> withoutVoxels{2};
  EXPECT_EQ(chooseReference(grids(), 3, withoutVoxels), VoxelReference{});
}

TEST(ExpectedFrom, HasTheMappedValuesOfTheReference) {
  const auto all = grids();
  const StoredGrid expected = expectedFrom(all, 3, {1, kGain, kOffset});
  const SparseVolume of = volumeOf(*all[1].voxels), mapped = volumeOf(*expected.voxels);
  ASSERT_EQ(mapped.bricks, of.bricks);
  for (std::size_t i = 0; i < of.values.size(); ++i) {
    const bool isActive = of.active[i / kBrickVoxels].test(int(i % kBrickVoxels));
    const double value = double(kGain) * double(of.values[i]) + double(kOffset);
    EXPECT_EQ(mapped.values[i], isActive ? float(value) : mapped.values[i]) << i;
  }
}

TEST(ExpectedFrom, HasTheFarBackgroundOfTheGridThatRefers) {
  auto all = grids();
  all[3].farBackground = true;
  all[3].field.background = 7.0f;
  const StoredGrid expected = expectedFrom(all, 3, {1, kGain, kOffset});
  EXPECT_TRUE(expected.farBackground) << "a conversion would ignore it and fit ellipsoids again";
  EXPECT_EQ(expected.field.background, 7.0f);
}

TEST(ExpectedFrom, HasNoBricksWithoutAReference) {
  EXPECT_TRUE(expectedFrom(grids(), 3, {}).voxels->bricks.empty());
}

struct Input {
  GridDescriptor descriptor;
  SparseVolume volume = test::tubeVolume();
  [[nodiscard]] InputKey key() const { return keyOf({descriptor, volume}); }
};

struct Change {
  const char* name;
  std::function<void(Input&)> make;
};
void PrintTo(const Change& change, std::ostream* out) { *out << change.name; }

class InputKeyChange : public testing::TestWithParam<Change> {};

TEST_P(InputKeyChange, IsNoticed) {
  Input input;
  GetParam().make(input);
  EXPECT_NE(input.key(), Input{}.key());
}

void toggle(BrickMask& mask) { mask.words[7] ^= std::uint64_t{1} << 63; }

INSTANTIATE_TEST_SUITE_P(
    All, InputKeyChange,
    testing::Values(
        Change{"value", [](Input& i) { i.volume.values.back() += 1e-6f; }},
        Change{"sign of zero", [](Input& i) { i.volume.background = -i.volume.background; }},
        Change{"activity", [](Input& i) { toggle(i.volume.active.back()); }},
        Change{"origin", [](Input& i) { i.volume.origin.z += kBrickSide; }},
        Change{"position of a brick", [](Input& i) { i.volume.bricks.back().z += 1; }},
        Change{"level set", [](Input& i) { i.descriptor.gridClass = GridClass::kLevelSet; }},
        Change{"doubles", [](Input& i) { i.descriptor.valueType = ValueType::kDouble; }}));

TEST(InputKey, DoesNotDependOnTheRestOfTheDescriptor) {
  Input input;
  input.descriptor.name = "other";
  input.descriptor.gridClass = GridClass::kFogVolume;
  input.descriptor.valueType = ValueType::kHalf;
  input.descriptor.transform.mapType = "AffineMap";
  input.descriptor.metadata = {{"note", "string", {}}};
  EXPECT_EQ(input.key(), Input{}.key());
}

}  // namespace
}  // namespace esvr
