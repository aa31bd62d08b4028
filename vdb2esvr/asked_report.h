#pragma once
/// The part of the report that says what was asked for.

#include <nlohmann/json_fwd.hpp>

#include "vdb2esvr/options.h"

namespace esvr::vdb2esvr {

/// The options that affect the conversion, with those of its speed (`asked` in the report).
[[nodiscard]] nlohmann::ordered_json askedJson(const Options& options);

}  // namespace esvr::vdb2esvr
