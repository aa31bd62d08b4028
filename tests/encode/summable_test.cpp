// Plan: values up to the limit are fitted and decoded as if they were ordinary ones. Beyond it, the
// same goals store voxels, and what needs ellipsoids is refused with the name of the grid and the
// voxel.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "encode/volumes.h"
#include "esvr/encode.h"
#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"

namespace esvr {
namespace {

SparseVolume timesLarge(double factor, float background = 0.0f) {
  SparseVolume volume = test::tubeVolume();
  volume.background = background;
  for (float& value : volume.values) value = float(value * factor);
  return volume;
}

Conversion convertedTo(const SparseVolume& volume, const Goal& goal,
                       Representation representation = Representation::kAuto) {
  ConvertOptions options;
  options.goal = goal;
  options.representation = representation;
  options.fit.count = 30;
  options.fit.iterations = 60;
  GridDescriptor descriptor;
  descriptor.name = "vast";
  return convertVolume({descriptor, volume}, options);
}

// The scale is a power of two, so that nothing but the values changes.
TEST(TooLargeForSums, LeavesValuesAtTheLimitToTheFit) {
  const auto psnr = [](double factor) {
    const SparseVolume volume = timesLarge(factor);
    const Conversion conversion = convertedTo(volume, FitGoal{}, Representation::kEllipsoids);
    EXPECT_FALSE(conversion.grid.voxels);
    return compareVolumes(volume, decodeGrid(conversion.grid)).psnrBox;
  };
  EXPECT_NEAR(psnr(0x1p119), psnr(1.0), 1e-3);
}

TEST(TooLargeForSums, StoresVoxelsInstead) {
  const SparseVolume volume = timesLarge(3e38);
  for (const Goal& goal : {Goal{PsnrGoal{60.0}}, Goal{PresetGoal{}}, Goal{SizeGoal{4000}},
                           Goal{BoundGoal{.bound = 1e36}}, Goal{LosslessGoal{}}}) {
    const Conversion conversion = convertedTo(volume, goal);
    EXPECT_TRUE(conversion.grid.voxels);
    EXPECT_GT(compareVolumes(volume, decodeGrid(conversion.grid)).psnrBox, 35.0);
  }
}

TEST(TooLargeForSums, IsRefusedWhereEllipsoidsAreAskedFor) {
  const SparseVolume volume = timesLarge(3e38);
  const auto first = std::ranges::find_if(volume.values, [](float v) { return v > 0x1p120f; });
  const auto place = std::size_t(first - volume.values.begin());
  const std::string at =
      toString(volume.brickCorner(place / kBrickVoxels) + voxelLocal(int(place % kBrickVoxels)));
  const auto refused = [&](const Goal& goal, Representation representation) {
    try {
      (void)convertedTo(volume, goal, representation);
      ADD_FAILURE() << "was converted";
    } catch (const BadInput& error) {
      EXPECT_THAT(error.what(),
                  testing::AllOf(testing::HasSubstr("'vast'"), testing::HasSubstr(at)));
    }
  };
  refused(FitGoal{}, Representation::kAuto);
  refused(PsnrGoal{40.0}, Representation::kEllipsoids);
  EXPECT_THROW((void)convertByPaper({{}, volume}, {}, {}), BadInput);
}

}  // namespace
}  // namespace esvr
