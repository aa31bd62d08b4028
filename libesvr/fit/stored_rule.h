#pragma once
/// StoredValue, voxel by voxel, in a form that a GPU can be handed too.

#include <cmath>
#include <limits>

#include "esvr/kernel.h"
#include "field/stored_value.h"

namespace esvr {

struct StoredRule {
  float background = 0.0f;
  float low = -std::numeric_limits<float>::infinity();
  float high = std::numeric_limits<float>::infinity();
  float threshold = 0.0f;
  bool narrowBand = false;

  /// What a reader makes of a value of the field.
  [[nodiscard]] ESVR_HD float operator()(float value) const {
    const float settled = value < low ? low : (high < value ? high : value);
    const float activity =
        narrowBand ? background - std::fabs(settled) : std::fabs(settled - background);
    if (activity > threshold) return settled;
    return narrowBand ? std::copysign(background, settled) : background;
  }
};

[[nodiscard]] inline StoredRule storedRule(const StoredValue& stored) {
  StoredRule rule;
  rule.background = stored.rule.background;
  if (stored.rule.range) rule.low = stored.rule.range->min, rule.high = stored.rule.range->max;
  rule.threshold = stored.threshold;
  rule.narrowBand = stored.rule.narrowBand;
  return rule;
}

}  // namespace esvr
