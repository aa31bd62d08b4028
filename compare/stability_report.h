#pragma once
/// The results of `esvr-compare stability` as text and as JSON.

#include <iosfwd>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "compare/stability_options.h"
#include "compare/stability_record.h"

namespace esvr::compare {

/// PASS or FAIL, with the digits that are correct or lost: "PASS, 6 digits are correct".
[[nodiscard]] std::string verdictOf(const GridStability& grid, const DeviceStability& device);

void printStability(const StabilityRecord& record, std::ostream& out);

[[nodiscard]] nlohmann::ordered_json stabilityReport(const StabilityRequest& request,
                                                     const StabilityRecord& record);

}  // namespace esvr::compare
