// Plan: intensity_cases.h on the CPU; the same bits on any number of threads; the rule of stored
// values in its two forms.

#include <tbb/global_control.h>

#include <limits>

#include "fit/stored_rule.h"
#include "intensity_cases.h"

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

TEST(StoredRule, IsStoredValueInAnotherForm) {
  const StoredValue values[] = {
      {{.background = 0.25f}, 0.1f},
      {{.background = 0.25f}, -std::numeric_limits<float>::max()},
      {{.background = 0.0f, .range = ValueRange{-0.5f, 0.75f}}, 0.2f},
      {{.background = 3.0f, .narrowBand = true}, 0.0f},
      {{.background = 3.0f, .range = ValueRange{-2.0f, 2.5f}, .narrowBand = true}, 0.6f}};
  for (const StoredValue& stored : values)
    for (float v = -5.0f; v < 5.0f; v += 0.03125f) EXPECT_EQ(storedRule(stored)(v), stored(v)) << v;
}

}  // namespace
}  // namespace esvr
