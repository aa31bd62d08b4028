#pragma once
/// --report: docs/report.md is its manual.

#include <nlohmann/json_fwd.hpp>

#include "vdb2esvr/options.h"
#include "vdb2esvr/run_record.h"

namespace esvr::vdb2esvr {

[[nodiscard]] nlohmann::ordered_json makeReport(const Options& options, const RunRecord& record);

}  // namespace esvr::vdb2esvr
