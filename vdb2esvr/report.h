#pragma once
/// The JSON report of --report, which docs/report.md describes.

#include <nlohmann/json_fwd.hpp>

#include "esvr/error.h"
#include "vdb2esvr/options.h"
#include "vdb2esvr/run_record.h"

namespace esvr::vdb2esvr {

/// The name and the version of a report's form. docs/report.md says when the version changes.
struct ReportSchema {
  const char* name;
  int version;
};

[[nodiscard]] nlohmann::ordered_json makeReport(const Options& options, const RunRecord& record);

/// True if the options want a report in a file.
[[nodiscard]] bool reportIsFile(const Options& options);

/// The first items of every report: program, versions and options.
/// \param schema  its name and its version
[[nodiscard]] nlohmann::ordered_json reportHead(const Options& options, const ReportSchema& schema);

/// The report of a run that failed: its options and the error.
[[nodiscard]] nlohmann::ordered_json makeFailureReport(const Options& options, const Error& error);

}  // namespace esvr::vdb2esvr
