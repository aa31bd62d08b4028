#pragma once
/// The JSON report of --report, which docs/report.md describes.

#include <nlohmann/json_fwd.hpp>

#include "esvr/error.h"
#include "vdb2esvr/options.h"
#include "vdb2esvr/run_record.h"

namespace esvr::vdb2esvr {

[[nodiscard]] nlohmann::ordered_json makeReport(const Options& options, const RunRecord& record);

/// The options that affect the conversion, with those of its speed (`asked` in the report).
[[nodiscard]] nlohmann::ordered_json askedJson(const Options& options);

/// The report of a run that failed: its options and the error.
[[nodiscard]] nlohmann::ordered_json makeFailureReport(const Options& options, const Error& error);

}  // namespace esvr::vdb2esvr
