#pragma once
/// Finds the options of esvr-render that give a transfer function.

#include <optional>
#include <string>

#include "esvr/transfer_function.h"

namespace esvr::view {

/// The built-in color map and opacity curve over a range of values.
struct LookNames {
  std::string colors, opacity;
  ValueRange range;
};

/// \return nothing if the function is not made of a built-in map and a built-in curve over one range
[[nodiscard]] std::optional<LookNames> namesOf(const TransferFunction& function);

}  // namespace esvr::view
