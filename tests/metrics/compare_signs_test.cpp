// Plan: equal volumes have no sign errors; each voxel whose sign is changed is counted, active or
// not, and 0 counts as outside. A brick that only one volume has is compared with the sign of the
// empty space of the other one.

#include <gtest/gtest.h>

#include <algorithm>
#include <tuple>
#include <utility>
#include <vector>

#include "../fit/volumes.h"
#include "esvr/sign_errors.h"

namespace esvr {
namespace {

TEST(CompareSigns, CountsEveryVoxelOnTheWrongSide) {
  const SparseVolume band = test::levelSetVolume();
  SparseVolume other = band;
  EXPECT_EQ(compareSigns(band, other).voxels, 0u);
  EXPECT_FALSE(compareSigns(band, other).first);
  std::size_t flipped = 0;
  for (std::size_t i = 0; i < other.values.size(); i += 1001, ++flipped)
    other.values[i] = band.values[i] < 0.0f ? 0.0f : -0.5f;
  const SignErrors errors = compareSigns(band, other);
  EXPECT_EQ(errors.voxels, flipped);
  EXPECT_EQ(errors.first, band.brickCorner(0));
}

TEST(CompareSigns, IgnoresTheMagnitude) {
  const SparseVolume band = test::levelSetVolume();
  SparseVolume other = band;
  for (float& v : other.values) v = v < 0.0f ? -1e-30f : 0.0f;
  EXPECT_EQ(compareSigns(band, other).voxels, 0u);
}

TEST(CompareSigns, KnowsTheSideOfEmptySpace) {
  const SparseVolume band = test::levelSetVolume();
  const auto with = [&](Coord place, float value) {
    std::vector<BrickInput> bricks(1);
    bricks[0].corner = place * kBrickSide;
    bricks[0].values.fill(value);
    bricks[0].active.setAll();
    for (std::size_t b = 0; b < band.brickCount(); ++b) {
      BrickInput own{band.brickCorner(b), {}, band.active[b]};
      std::ranges::copy(band.brickValues(b), own.values.begin());
      bricks.push_back(own);
    }
    return makeVolume(std::move(bricks), band.background);
  };
  const Coord inside{2, 2, 2}, outside{-1, 2, 2};
  for (const auto& [brick, value, errors] :
       {std::tuple{inside, -1.0f, 0u}, std::tuple{inside, 1.0f, 512u},
        std::tuple{outside, 1.0f, 0u}, std::tuple{outside, -1.0f, 512u}}) {
    const SparseVolume more = with(brick, value);
    ASSERT_EQ(more.brickCount(), band.brickCount() + 1);
    EXPECT_EQ(compareSigns(band, more).voxels, errors);
    EXPECT_EQ(compareSigns(more, band).voxels, errors);
  }
}

}  // namespace
}  // namespace esvr
