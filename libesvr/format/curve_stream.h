#pragma once
/// A fit's curve as bytes of a section: one array a quantity.

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "esvr/fit_record.h"

namespace esvr::format {

/// \throws RuntimeFailure  a time or an error that is not finite, a PSNR that is not a number
[[nodiscard]] std::vector<std::byte> putCurve(std::span<const CurvePoint> curve);

/// \throws BadInput  the same; begins with `where`
[[nodiscard]] std::vector<CurvePoint> getCurve(std::span<const std::byte> content,
                                               const std::string& where);

}  // namespace esvr::format
