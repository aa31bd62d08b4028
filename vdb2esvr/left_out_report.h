#pragma once
/// The list `left_out` of a report.

#include <nlohmann/json.hpp>
#include <vector>

#include "vdb2esvr/scene_notes.h"

namespace esvr::vdb2esvr {

/// A figure that is not known has no key.
[[nodiscard]] nlohmann::ordered_json leftOutJson(const std::vector<LeftOut>& notes);

}  // namespace esvr::vdb2esvr
