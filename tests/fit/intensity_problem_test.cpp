// Plan: the tests of intensity_cases.h run on the CPU; the bits do not depend on the number of
// threads.

#include <tbb/global_control.h>

#include "fit/intensity_cases.h"

namespace esvr {
namespace {

using test::Intensities;
INSTANTIATE_TEST_SUITE_P(Cpu, Intensities, testing::Values("cpu"));

TEST(IntensityProblem, GivesTheSameBitsOnOneThread) {
  const Field field = test::someField();
  const SparseVolume volume = test::tubeVolume();
  const IntensityTarget target = test::targetOf(volume);
  std::vector<float> many(field.ellipsoidCount(), 0.2f), one = many;
  IntensityProblem problem(target);
  problem.setShapes(field);
  (void)problem.solve(many, 10);
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
  problem.setShapes(field);
  (void)problem.solve(one, 10);
  EXPECT_EQ(many, one);
}

}  // namespace
}  // namespace esvr
