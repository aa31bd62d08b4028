#pragma once
/// --report: docs/report.md is its manual.

#include <nlohmann/json_fwd.hpp>

#include "esvr/error.h"
#include "vdb2esvr/options.h"
#include "vdb2esvr/run_record.h"

namespace esvr::vdb2esvr {

[[nodiscard]] nlohmann::ordered_json makeReport(const Options& options, const RunRecord& record);

/// The report of a run that wrote no file: what was asked, and the error that ended it.
[[nodiscard]] nlohmann::ordered_json makeFailureReport(const Options& options, const Error& error);

}  // namespace esvr::vdb2esvr
