// Plan: the searches for a size and for a PSNR allow both signs of intensities where this is
// better, and only there. A gyroid with a plateau is such a volume; smooth blobs are not.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "convert/attempt.h"
#include "esvr/convert.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"
#include "volumes.h"

namespace esvr {
namespace {

/// A gyroid whose inside is a plateau. Many of its borders are concave.
SparseVolume gyroidVolume() {
  constexpr double kTurns = 2.0 * std::numbers::pi / 22.0;  // a period of 22 voxels
  return test::volumeOf({}, 4, 0.0f, [](Coord v) {
    const double x = kTurns * v.x, y = kTurns * v.y, z = kTurns * v.z;
    const double g =
        std::sin(x) * std::cos(y) + std::sin(y) * std::cos(z) + std::sin(z) * std::cos(x);
    return float(std::clamp(2.0 * g, 0.0, 1.0));
  });
}

const GridDescriptor& descriptor() {
  static const GridDescriptor grid = [] {
    GridDescriptor g;
    g.name = "density";
    return g;
  }();
  return grid;
}

ConvertOptions searching(const Goal& goal) {
  ConvertOptions options;
  options.goal = goal;
  options.representation = Representation::kEllipsoids;
  options.fit.iterations = 800;
  return options;
}

Conversion converted(const SparseVolume& volume, const ConvertOptions& options) {
  return convertVolume({descriptor(), volume}, options);
}

double psnrOf(const SparseVolume& volume, const Conversion& conversion) {
  return compareVolumes(volume, decodeGrid(conversion.grid)).psnrBox;
}

TEST(Signs, SlowAreBothForAGyroidOfAGivenSize) {
  const SparseVolume gyroid = gyroidVolume();
  ConvertOptions options = searching(SizeGoal{6000});
  const Conversion free = converted(gyroid, options);
  options.fit.bothSigns = false;
  const Conversion positive = converted(gyroid, options);
  EXPECT_TRUE(free.fit.signedIntensities);
  EXPECT_FALSE(positive.fit.signedIntensities);
  EXPECT_GT(psnrOf(gyroid, free), psnrOf(gyroid, positive) + 1.0);
}

/// A short fit, and the same with the better signs.
convert::Attempt withBetterSigns(const SparseVolume& volume, double count,
                                 ConvertOptions& options) {
  const ConvertInput input{descriptor(), volume};
  return convert::withBetterSigns(
      input, attempt({input, options}, count, convert::FitLength::kShort), options);
}

TEST(Signs, SlowAreChosenAfterAShortFit) {
  ConvertOptions options = searching(PsnrGoal{40.0});
  const auto first = withBetterSigns(gyroidVolume(), 800, options);
  EXPECT_TRUE(options.fit.bothSigns.value_or(false));
  EXPECT_TRUE(first.fit.signedIntensities);
  EXPECT_TRUE(first.bothSigns.tried && first.bothSigns.used);
  EXPECT_GT(first.bothSigns.seconds, 0.0);
}

TEST(Signs, AreThoseOfTheValuesWhereFewAreExtreme) {
  ConvertOptions options = searching(SizeGoal{6000});
  const auto first = withBetterSigns(test::smoothVolume(), 50, options);
  EXPECT_FALSE(options.fit.bothSigns);
  EXPECT_FALSE(first.bothSigns.tried);
}

TEST(Signs, OfAnOptionAreKept) {
  ConvertOptions options = searching(SizeGoal{6000});
  options.fit.bothSigns = false;
  (void)withBetterSigns(gyroidVolume(), 50, options);
  EXPECT_FALSE(*options.fit.bothSigns);
}

}  // namespace
}  // namespace esvr
