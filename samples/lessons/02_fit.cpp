// Lesson 2: from voxels to ellipsoids.
//
// fit() finds ellipsoids whose sum reproduces the volume. One says what is wanted: a number of
// ellipsoids, a PSNR, a time. All else follows from the data.

#include <cstdio>

#include "check.h"
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

  // The curve says how the error fell with time: the first thing to look at when a fit is not as
  // good as hoped.
  for (const esvr::TimedCurvePoint& point : result.curve)
    std::printf("iteration %4u, %zu ellipsoids, %.2f dB\n", point.iteration,
                std::size_t(point.ellipsoids), point.psnrBox);

  check(result.field.ellipsoidCount() <= 40, "no more ellipsoids than were asked for");
  check(result.curve.back().psnrBox > 30.0, "40 ellipsoids make a ring at more than 30 dB");

  // The same input gives the same ellipsoids, bit for bit, on any number of threads.
  options.progress = nullptr;
  const esvr::FitResult again = esvr::fit(ring, options);
  check(again.field.chunks[0].ellipsoids.intensity == result.field.chunks[0].ellipsoids.intensity,
        "a second fit is the same");
}
