// Plan: the rule for both devices gives to the bit what revoxelise()'s own (field/stored_value.h)
// gives, over backgrounds, ranges, thresholds and bands.
#include "render/voxel_value.h"

#include <gtest/gtest.h>

#include "field/stored_value.h"

namespace esvr::test {
namespace {

void expectTheRule(float background, const RevoxeliseOptions& rule) {
  const StoredValue expected{{background, rule.range, rule.narrowBand}, rule.threshold};
  const VoxelValue value = voxelValue(background, rule);
  for (float v = -2.0f; v <= 2.0f; v += 0.0625f)
    EXPECT_EQ(value(v), expected(v)) << background << " " << rule.threshold << " " << v;
}

TEST(VoxelValue, IsTheRuleOfRevoxelise) {
  const std::optional<ValueRange> ranges[] = {std::nullopt, ValueRange{-0.5f, 0.75f}};
  for (const float threshold : {-1.0f, 0.0f, 0.125f})
    for (const auto& range : ranges) {
      for (const float background : {0.0f, 0.25f, -1.0f})
        expectTheRule(background, {.threshold = threshold, .range = range});
      expectTheRule(0.5f, {.threshold = threshold, .range = range, .narrowBand = true});
    }
}

}  // namespace
}  // namespace esvr::test
