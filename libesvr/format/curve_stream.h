#pragma once
/// The curve of a fit as the content of a section: one array for each quantity.

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "esvr/fit_record.h"

namespace esvr::format {

/// \throws RuntimeFailure  an error is not finite, or a PSNR is NaN
[[nodiscard]] std::vector<std::byte> putCurve(std::span<const CurvePoint> curve);

/// \throws BadInput  as putCurve, or the size is wrong; the text begins with `where`
[[nodiscard]] std::vector<CurvePoint> getCurve(std::span<const std::byte> content,
                                               const std::string& where);

}  // namespace esvr::format
