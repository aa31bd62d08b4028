// Lesson 2: from voxels to ellipsoids.
//
// fit() finds ellipsoids whose sum reproduces the volume. The options state a goal: a number of
// ellipsoids, a PSNR or a time. All other parameters follow from the data.

#include <cstdio>

#include "esvr/fit.h"
#include "ring.h"

int main() {
  const esvr::SparseVolume ring = makeRing();

  esvr::FitOptions options;
  options.count = 40;
  options.preset = esvr::Preset::kDraft;
  options.progress = [](const esvr::FitProgress& p) {
    std::printf("%3.0f %%: %.1f dB\n", 100.0 * p.fraction, p.point.psnrBox);
  };
  const esvr::FitResult result = esvr::fit(ring, options);

  // The curve shows how the error decreased with time. Check it first if a fit is worse than
  // expected.
  for (const esvr::TimedCurvePoint& point : result.curve)
    std::printf("iteration %4u, %zu ellipsoids, %.2f dB\n", point.iteration,
                std::size_t(point.ellipsoids), point.psnrBox);

  check(result.field.ellipsoidCount() <= 40, "the fit has at most the wanted number of ellipsoids");
  check(result.curve.back().psnrBox > 30.0,
        "40 ellipsoids represent the ring with more than 30 dB");

  // The same input gives the same ellipsoids, bit for bit, on any number of threads.
  options.progress = nullptr;
  const esvr::FitResult again = esvr::fit(ring, options);
  check(again.field.chunks[0].ellipsoids.intensity == result.field.chunks[0].ellipsoids.intensity,
        "a second fit gives the same result");
}
