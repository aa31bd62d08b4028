// Plan: the PSNR between voxels is compared with a float64 evaluation at the same positions. The
// tests use sums that are clamped, a background that is not 0, and a narrow band.

#include "esvr/psnr_between.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "esvr/field.h"
#include "esvr/fit.h"
#include "esvr/metrics.h"
#include "interpolate.h"
#include "volumes.h"

namespace esvr {
namespace {

/// A field that is moved by an offset. Its ellipsoids must be wide, since its centers are rounded to
/// float32.
Field moved(Field field, const Offset& offset) {
  for (std::size_t a = 0; a < 3; ++a)
    for (float& c : field.chunks[0].ellipsoids.center[a]) c = float(double(c) - offset[a]);
  return field;
}

double reference(const SparseVolume& volume, const Field& field, const BetweenOptions& options) {
  constexpr std::uint64_t kPositions = 8;
  const Box box = options.box.value_or(activeBox(volume));
  const auto source = [&](Coord v) { return double(valueAt(volume, v)); };
  double squares = 0.0;
  for (std::uint64_t n = 0; n < kPositions; ++n) {
    const Offset offset = offsetOf(n, 0.0);
    const Field at = moved(field, offset);
    for (std::int32_t x = box.min.x; x <= box.max.x; ++x)
      for (std::int32_t y = box.min.y; y <= box.max.y; ++y)
        for (std::int32_t z = box.min.z; z <= box.max.z; ++z) {
          double sum = evaluateReference(at, {x, y, z});
          if (options.range)
            sum = std::clamp(sum, double(options.range->min), double(options.range->max));
          squares += std::pow(sum - test::interpolate(offset, {x, y, z}, source), 2);
        }
  }
  return psnr(squares / (kPositions * box.volume()), peakOf(volume));
}

Field fewEllipsoids(float background) {
  Field field =
      test::randomField({.count = 12, .extent = 30.0, .smallest = 2.0, .aspect = 2.0, .seed = 21});
  field.background = background;
  return field;
}

// Both sides sum float32 values of a dozen ellipsoids, each to within 4e-6.
constexpr double kDecibels = 1e-4;  // dB

TEST(PsnrBetween, AgreesWithFloat64) {
  const SparseVolume tube = test::tubeVolume();
  const Box part{{4, 10, 8}, {27, 30, 25}};
  for (const BetweenOptions& options :
       {BetweenOptions{}, BetweenOptions{.range = ValueRange{0.0f, 0.5f}},
        BetweenOptions{.box = part}})
    EXPECT_NEAR(psnrBetween(tube, fewEllipsoids(0.0f), options),
                reference(tube, fewEllipsoids(0.0f), options), kDecibels);
}

TEST(PsnrBetween, TakesTheBackgroundOutsideTheBricks) {
  SparseVolume tube = test::tubeVolume();
  tube.background = 0.25f;
  const BetweenOptions corner{.box = Box{{-9, -9, -9}, {9, 20, 20}}};
  EXPECT_NEAR(psnrBetween(tube, fewEllipsoids(0.25f), corner),
              reference(tube, fewEllipsoids(0.25f), corner), kDecibels);
}

// Beyond the bricks of a narrow band, nothing counts, and interpolation takes the nearest voxel.
TEST(PsnrBetween, CountsTheBricksOfANarrowBandOnly) {
  const SparseVolume band = test::levelSetVolume();
  Field far = fewEllipsoids(3.0f);
  for (float& c : far.chunks[0].ellipsoids.center[0]) c += 1000.0f;
  Field none = far;
  none.chunks.clear();
  const BetweenOptions options{.narrowBand = true};
  EXPECT_EQ(psnrBetween(band, far, options), psnrBetween(band, none, options));
}

// Inside the surface, a fit leaves sums far below the band, because a reader clamps them.
TEST(PsnrBetween, ClampsSumsToANarrowBand) {
  const SparseVolume band = test::levelSetVolume();
  FitOptions options;
  options.count = 150;
  options.iterations = 200;
  options.narrowBand = true;
  options.fitFor = FitFor::kDrawing;
  const FitResult result = fit(band, options);
  EXPECT_NEAR(psnrBetween(band, result.field, {.narrowBand = true}), result.curve.back().psnrBox,
              6.0);
}

}  // namespace
}  // namespace esvr
