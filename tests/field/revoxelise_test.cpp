// Plan: the rule follows its definition in RevoxeliseOptions for all backgrounds, ranges,
// thresholds and bands, and revoxelise() applies it. The voxels of a box in a brick are compared with a
// test of every voxel, for boxes that cut through it, miss it, contain it, are empty, or end at the
// limits of 32-bit integers. The region of a brick is compared with its definition for all combinations
// of box, bricks and masks, and voxels that are always active are, also where no ellipsoid is.

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "field/random_field.h"
#include "field/voxel_rule.h"

namespace esvr {
namespace {

// The rule.

float byDefinition(float background, const RevoxeliseOptions& o, float sum) {
  const float value = o.range ? std::clamp(sum, o.range->min, o.range->max) : sum;
  if (o.narrowBand) {
    if (std::abs(value) < background - o.threshold) return value;
    return value < 0.0f ? -background : background;
  }
  return std::abs(value - background) > o.threshold ? value : background;
}

void expectTheRule(float background, const RevoxeliseOptions& options) {
  const VoxelRule rule = makeVoxelRule(background, options);
  for (float v = -2.0f; v <= 2.0f; v += 0.0625f)
    EXPECT_EQ(rule(v), byDefinition(background, options, v))
        << background << " " << options.threshold << " " << v;
}

TEST(VoxelRule, IsThatOfRevoxeliseOptions) {
  const std::optional<ValueRange> ranges[] = {std::nullopt, ValueRange{-0.5f, 0.75f}};
  for (const float threshold : {-1.0f, 0.0f, 0.125f})
    for (const auto& range : ranges) {
      for (const float background : {0.0f, 0.25f, -1.0f})
        expectTheRule(background, {.threshold = threshold, .range = range});
      expectTheRule(0.5f, {.threshold = threshold, .range = range, .narrowBand = true});
    }
}

TEST(VoxelRule, KeepsTheSignOfWhatIsNotInTheBand) {
  const VoxelRule rule = makeVoxelRule(3.0f, {.narrowBand = true});
  EXPECT_EQ(rule(-4.0f), -3.0f);
  EXPECT_EQ(rule(4.0f), 3.0f);
  EXPECT_EQ(rule(-2.0f), -2.0f);
}

// Regions.

BrickMask maskByVoxels(const Box& box, Coord corner) {
  BrickMask mask;
  for (int v = 0; v < kBrickVoxels; ++v)
    if (box.contains(corner + voxelLocal(v))) mask.set(v);
  return mask;
}

TEST(ActiveRegion, HasTheVoxelsOfABox) {
  constexpr int kFarthest = Box::kMax - (kBrickSide - 1);
  for (const Coord corner : {Coord{0, 0, 0}, Coord{-8, 16, 800}, Coord{kFarthest, Box::kMin, 0}})
    for (const Box& box :
         {Box{}, Box::whole(), Box{corner, corner}, Box{{-5, 17, 0}, {3, 20, 803}},
          Box{{1, 2, 3}, {1, 2, 3}}, Box{{3, 3, 3}, {100, 100, 2}},
          Box{{-100, -100, -100}, {-1, 100, 900}},
          Box{{kFarthest + 3, Box::kMin, 5}, {Box::kMax, Box::kMin + 2, Box::kMax}}})
      EXPECT_EQ(maskOf(box, corner), maskByVoxels(box, corner));
}

TEST(LocalBox, ContainsTheVoxelsOfTheCellsOfABrick) {
  const Box box{{-3, 4, 9}, {8, 8, 12}};
  const LocalBox local = localBox(box, {0, 0, 8}, kBrickSide);
  for (int x = 0; x <= kBrickSide; ++x)
    for (int y = 0; y <= kBrickSide; ++y)
      for (int z = 0; z <= kBrickSide; ++z)
        EXPECT_EQ(local.contains(x, y, z), box.contains({x, y, z + 8}));
}

TEST(ActiveRegion, IsThatOfTheBoxTheBricksAndTheMasks) {
  const Box box{{4, 0, 0}, {11, 7, 7}};
  const std::vector<Coord> bricks{{0, 0, 0}, {8, 0, 0}};
  std::vector<BrickMask> masks(2);
  masks[0].setAll(), masks[1].set(5);
  const Coord elsewhere{0, 8, 0};

  const RevoxeliseOptions inBox{.box = box};
  EXPECT_EQ(regionIn(inBox, bricks[0]).within, maskByVoxels(box, bricks[0]));
  EXPECT_EQ(regionIn(inBox, bricks[0]).certain.count(), 0);

  const RevoxeliseOptions inBricks{.bricks = bricks, .restrictToBricks = true};
  EXPECT_EQ(regionIn(inBricks, bricks[0]).within.count(), kBrickVoxels);
  EXPECT_EQ(regionIn(inBricks, bricks[0]).certain.count(), 0);
  EXPECT_EQ(regionIn(inBricks, elsewhere).within.count(), 0);

  const RevoxeliseOptions masked{
      .bricks = bricks, .restrictToBricks = true, .masks = masks, .box = box};
  EXPECT_EQ(regionIn(masked, bricks[0]).within, maskByVoxels(box, bricks[0]));
  EXPECT_EQ(regionIn(masked, bricks[1]).within, masks[1]);
  EXPECT_EQ(regionIn(masked, bricks[1]).certain, masks[1]);
  EXPECT_EQ(regionIn(masked, elsewhere).within.count(), 0);
}

// One voxel lies where no ellipsoid reaches, one outside the box.
TEST(ActiveRegion, SomeVoxelsAreAlwaysActive) {
  const std::vector<Coord> always{{-40, 3, 9}, {1, 0, 0}, {9, 0, 0}};
  RevoxeliseOptions options{
      .threshold = 100.0f, .box = {{-40, -40, -40}, {8, 40, 40}}, .alwaysActive = always};
  const Field field = test::randomField({.count = 20, .extent = 30.0});
  const SparseVolume volume = revoxelise(field, options);
  EXPECT_EQ(activeVoxelCount(volume), 2u);
  EXPECT_EQ(activeBox(volume), (Box{{-40, 0, 0}, {1, 3, 9}}));
  EXPECT_EQ(valueAt(volume, always[0]), field.background);
  options.threshold = -1.0f;
  options.alwaysActive = {};
  EXPECT_EQ(valueAt(volume, always[1]), valueAt(revoxelise(field, options), always[1]));
}

// A mask makes voxels active whose values are the background, and no others.
TEST(ActiveRegion, VoxelsOfAMaskAreActiveWhateverTheirValues) {
  BrickRegion region;
  region.within.set(0), region.within.set(1);
  region.certain = region.within;
  std::vector<float> values(kBrickVoxels, 1.0f);
  values[0] = 0.25f;
  const VoxelRule rule{.background = 0.25f, .threshold = 0.5f};
  EXPECT_EQ(settle(rule, region, values), region.within);
  EXPECT_EQ(values[0], 0.25f);
  EXPECT_EQ(values[1], 1.0f);
  EXPECT_EQ(values[2], 0.25f);
  region.certain = {};
  values.assign(kBrickVoxels, 1.0f);
  values[0] = 0.5f;
  const BrickMask active = settle(rule, region, values);
  EXPECT_EQ(active.count(), 1);
  EXPECT_TRUE(active.test(1));
  EXPECT_EQ(values[0], 0.25f);
}

}  // namespace
}  // namespace esvr
