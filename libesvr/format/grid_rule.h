#pragma once
/// How the voxels of a stored grid are found active.

#include "esvr/container.h"
#include "field/activity.h"

namespace esvr::format {

[[nodiscard]] ActivityRule ruleOf(const StoredGrid& grid);

}  // namespace esvr::format
