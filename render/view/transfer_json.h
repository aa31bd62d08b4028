#pragma once
/// Transfer functions in messages: {"space": "RGB", "colors": [[x, r, g, b], ...],
/// "opacity": [[x, opacity, midpoint, sharpness], ...]}.

#include <nlohmann/json.hpp>

#include "esvr/transfer_function.h"

namespace esvr::view {

[[nodiscard]] nlohmann::json jsonOf(const TransferFunction& function);
[[nodiscard]] nlohmann::json jsonOf(const ColorMap& map);
[[nodiscard]] nlohmann::json jsonOf(const OpacityCurve& curve);

/// \throws BadInput    a member is missing or has the wrong form, or there are too many points
/// \throws UsageError  as for checkTransferFunction
[[nodiscard]] TransferFunction transferOf(const nlohmann::json& content);

}  // namespace esvr::view
