// Plan: a limit of one voxel makes every volume a large one. A smooth and a rough volume are
// converted for a preset as single files and as frames of a sequence. Single fits have as many
// ellipsoids for each voxel, so that the PSNR of the two differs by many dB. Steady goals must give
// both the PSNR of the preset.

#include "convert/preset.h"

#include <gtest/gtest.h>

#include <cmath>

#include "convert/volumes.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"

namespace esvr {
namespace {

/// Waves of five to seven voxels around a constant, in the box of smoothVolume().
SparseVolume roughVolume() {
  return test::volumeOf({}, 6, 0.0f, [](Coord v) {
    return float(1.0 + 0.25 * std::sin(1.3 * v.x) * std::sin(1.1 * v.y) * std::sin(0.9 * v.z));
  });
}

/// The PSNR over the active voxels of a large volume that is stored as ellipsoids.
double psnrOfLarge(const SparseVolume& volume, const PresetGoal& goal) {
  constexpr convert::VoxelLimits kLimits{.maxVoxels = 1, .sample = {.bricks = 64, .runs = 8}};
  const GridDescriptor descriptor;
  const ConvertInput input{descriptor, volume};
  ConvertOptions options;
  options.fit.preset = Preset::kDraft;
  options.fit.iterations = 200;
  options.representation = Representation::kEllipsoids;
  const Conversion conversion = convert::convertToPreset({input, options, kLimits}, goal, [&] {
    ConvertOptions single = options;
    single.goal = FitGoal{};
    return convertVolume(input, single);
  });
  return compareVolumes(volume, decodeGrid(conversion.grid)).psnrActive;
}

TEST(LargePreset, SlowIsASingleFitUnlessItIsSteady) {
  const double smooth = psnrOfLarge(test::smoothVolume(), {});
  const double rough = psnrOfLarge(roughVolume(), {});
  EXPECT_GT(std::abs(smooth - rough), 3.0) << smooth << " and " << rough << " dB";
}

TEST(LargePreset, SlowHasItsPsnrWhereItIsSteady) {
  const double wanted = presetPsnr(Preset::kDraft);
  // The search ends as soon as it is a little above the target, as for a PsnrGoal.
  constexpr double kAbove = 1.0;
  for (const SparseVolume& volume : {test::smoothVolume(), roughVolume()}) {
    const double psnr = psnrOfLarge(volume, {.steady = true});
    EXPECT_GE(psnr, wanted);
    EXPECT_LE(psnr, wanted + kAbove);
  }
}

}  // namespace
}  // namespace esvr
