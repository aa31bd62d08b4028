#pragma once
/// The colors of maps of the errors of pictures, and the scale that says what they mean.

#include "esvr/image.h"
#include "report/html.h"

namespace esvr::report {

/// The error with the last color; larger errors have this color too. The largest possible error of
/// a channel is 1.
inline constexpr double kMostError = 0.125;

/// Gives the pixels of a gray map their colors, from black to a light yellow. Colors change with
/// the square root of the error, so that small errors are seen.
/// \param map  errors as a share of kMostError, 0 to 1
void colorErrors(Image& map);

/// The scale of the colors, with ticks.
[[nodiscard]] Html errorScale();

}  // namespace esvr::report
