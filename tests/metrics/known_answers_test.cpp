// Plan: the metrics of two volumes agree with those that scikit-image and numpy compute for the
// same voxels as arrays (make_metrics_fixture.py; SSIM and FLIP have tests of their own). The
// tolerance is 1e-6; float64 sums of 32^3 values below 1 are precise to 1e-10.

#include <gtest/gtest.h>

#include "esvr/metrics.h"
#include "metrics/volumes.h"

namespace esvr {
namespace {

constexpr int kSide = 32, kFirst = 10, kLast = 21;
constexpr double kTolerance = 1e-10;

/// The same function as in make_ssim_fixture.py.
double hashed(std::uint64_t index) {
  return double((index * 2654435761u % (std::uint64_t{1} << 32)) >> 8) / (1 << 24);
}

/// A block of values. Those above `activeAbove` are active.
template <class ValueAt>
SparseVolume block(float background, double activeAbove, const ValueAt& valueAt) {
  const Box box{{kFirst, kFirst, kFirst}, {kLast, kLast, kLast}};
  SparseVolume volume = test::volumeOf(
      box,
      [&](Coord v) { return float(valueAt(std::uint64_t((v.x * kSide + v.y) * kSide + v.z))); },
      background);
  for (std::size_t b = 0; b < volume.brickCount(); ++b) {
    BrickMask mask;
    for (int i = 0; i < kBrickVoxels; ++i)
      if (volume.active[b].test(i) && double(volume.brickValues(b)[i]) > activeAbove) mask.set(i);
    volume.active[b] = mask;
  }
  return volume;
}

struct Known {
  float background;
  double massReference, massCandidate;
};

class KnownAnswers : public testing::TestWithParam<Known> {};

TEST_P(KnownAnswers, agreeWithScikitImage) {
  const Known& known = GetParam();
  const auto reference = block(known.background, 1.0 / 3.0, hashed);
  const auto candidate = block(known.background, 0.35, [](std::uint64_t i) {
    return 0.75 * hashed(i) + 0.25 * hashed(i + 1000003);
  });
  const auto m = compareVolumes(reference, candidate,
                                {.box = Box{{0, 0, 0}, {kSide - 1, kSide - 1, kSide - 1}},
                                 .peak = 0.9986540079116821});  // the largest value
  EXPECT_NEAR(m.psnrBox, 33.55627761263352, kTolerance);
  EXPECT_NEAR(m.psnrActive, 27.994649501576674, kTolerance);
  EXPECT_EQ(m.maxError, 0.2102183699607849);
  EXPECT_EQ(m.p999Error, 0.2102183699607849);
  EXPECT_NEAR(m.iou, 0.8934010152284264, kTolerance);
  EXPECT_NEAR(m.massReference, known.massReference, kTolerance);
  EXPECT_NEAR(m.massCandidate, known.massCandidate, kTolerance);
}

INSTANTIATE_TEST_SUITE_P(All, KnownAnswers,
                         testing::Values(Known{0.0f, 863.3728325366974, 863.1301729679108},
                                         Known{0.25f, 431.3728325366974, 431.13017296791077}));

}  // namespace
}  // namespace esvr
