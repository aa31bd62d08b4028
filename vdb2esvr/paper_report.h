#pragma once
/// The part of the report for a run of the paper's method.

#include <nlohmann/json_fwd.hpp>

#include "esvr/paper_method.h"

namespace esvr::vdb2esvr {

[[nodiscard]] nlohmann::ordered_json paperJson(const PaperRecord& record);

}  // namespace esvr::vdb2esvr
