#pragma once
/// The part of the report for one grid.

#include <cstddef>
#include <nlohmann/json_fwd.hpp>

#include "esvr/metrics.h"
#include "vdb2esvr/run_record.h"

namespace esvr::vdb2esvr {

/// \param g  index of the grid in the record
[[nodiscard]] nlohmann::ordered_json gridJson(const RunRecord& record, std::size_t g);

[[nodiscard]] nlohmann::ordered_json metricsJson(const VolumeMetrics& metrics);

[[nodiscard]] nlohmann::ordered_json secondsJson(const PhaseSeconds& seconds);

}  // namespace esvr::vdb2esvr
