// Plan: a field that is imported and exported again is the same field.

#include "fit/import_field.h"

#include <gtest/gtest.h>

#include "../field/random_field.h"
#include "fit/export_field.h"

namespace esvr {
namespace {

TEST(ImportField, IsTheWayBack) {
  const Field field = test::randomField(
      {.count = 200, .extent = 200.0, .smallest = 0.5, .aspect = 50.0, .origin = {64, 0, 128}});
  const Coord origin{64, 0, 128};
  const Field back = exportField(importField(field, origin, 0.5),
                                 {.origin = origin, .scale = 0.5, .kernel = field.kernel});
  ASSERT_EQ(back.chunks.size(), 1u);
  const Ellipsoids &a = field.chunks[0].ellipsoids, &b = back.chunks[0].ellipsoids;
  EXPECT_EQ(a.center, b.center);
  EXPECT_EQ(a.intensity, b.intensity);
  for (std::size_t i = 0; i < a.size(); ++i) {
    // The axes may come back in another order, but the matrix is the same to float32 precision.
    const Matrix3 A = inverse(unitFrame(a, i)), B = inverse(unitFrame(b, i));
    const double size = sigma(A, 0, 0) + sigma(A, 1, 1) + sigma(A, 2, 2);
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(sigma(A, r, c), sigma(B, r, c), 1e-5 * size) << i;
  }
}

}  // namespace
}  // namespace esvr
