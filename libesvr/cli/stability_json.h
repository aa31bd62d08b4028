#pragma once
/// The figures of esvr/stability.h in reports.

#include <nlohmann/json.hpp>

#include "esvr/stability.h"

namespace esvr::cli {

/// A number, or null if it is not finite, which JSON cannot express.
[[nodiscard]] nlohmann::ordered_json finiteOrNull(double value);

/// The differences: `max_difference`, `rms_difference`, `bound`, `share_of_bound`, `worst`.
[[nodiscard]] nlohmann::ordered_json differencesJson(const Stability& stability);

/// What makes a field difficult to evaluate: scales, aspect ratio, condition, kappa, intensities,
/// overlap, cancellation, and the numbers of bricks.
[[nodiscard]] nlohmann::ordered_json difficultiesJson(const Stability& stability);

}  // namespace esvr::cli
