#pragma once
/// What a reader makes of a value of the field: the rule of revoxelise(), voxel by voxel.

#include "field/activity.h"

namespace esvr {

struct StoredValue {
  ActivityRule rule;
  float threshold = 0.0f;

  [[nodiscard]] float operator()(float value) const {
    const float settled = rule.settled(value);
    return rule.activity(settled) > threshold ? settled : rule.inactiveValue(settled);
  }
};

}  // namespace esvr
