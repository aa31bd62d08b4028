// Plan: the rule follows its definition in RevoxeliseOptions for all backgrounds, ranges,
// thresholds and bands, and revoxelise() applies it.
#include "field/voxel_rule.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace esvr::test {
namespace {

float byDefinition(float background, const RevoxeliseOptions& o, float sum) {
  const float value = o.range ? std::clamp(sum, o.range->min, o.range->max) : sum;
  if (o.narrowBand) {
    if (std::abs(value) < background - o.threshold) return value;
    return value < 0.0f ? -background : background;
  }
  return std::abs(value - background) > o.threshold ? value : background;
}

void expectTheRule(float background, const RevoxeliseOptions& options) {
  const VoxelRule rule = makeVoxelRule(background, options);
  for (float v = -2.0f; v <= 2.0f; v += 0.0625f)
    EXPECT_EQ(rule(v), byDefinition(background, options, v))
        << background << " " << options.threshold << " " << v;
}

TEST(VoxelRule, IsThatOfRevoxeliseOptions) {
  const std::optional<ValueRange> ranges[] = {std::nullopt, ValueRange{-0.5f, 0.75f}};
  for (const float threshold : {-1.0f, 0.0f, 0.125f})
    for (const auto& range : ranges) {
      for (const float background : {0.0f, 0.25f, -1.0f})
        expectTheRule(background, {.threshold = threshold, .range = range});
      expectTheRule(0.5f, {.threshold = threshold, .range = range, .narrowBand = true});
    }
}

TEST(VoxelRule, KeepsTheSignOfWhatIsNotInTheBand) {
  const VoxelRule rule = makeVoxelRule(3.0f, {.narrowBand = true});
  EXPECT_EQ(rule(-4.0f), -3.0f);
  EXPECT_EQ(rule(4.0f), 3.0f);
  EXPECT_EQ(rule(-2.0f), -2.0f);
}

}  // namespace
}  // namespace esvr::test
