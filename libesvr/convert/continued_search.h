#pragma once
/// Converts a frame of a sequence by a fit that begins with the ellipsoids of the previous frame.

#include <optional>

#include "convert/attempt.h"

namespace esvr::convert {

/// True if the ellipsoids of a frame can continue those of the previous one (ConvertOptions).
[[nodiscard]] bool mayContinue(const Job& job);

/// The previous ellipsoids are moved as the volume has moved (motion_estimate.h) and fitted by a few
/// iterations. Their codes are chosen so that the differences from the previous frame take few bytes
/// and the PSNR is just reached.
/// \param psnr  dB over the box
/// \return nothing if the PSNR is not reached by as many ellipsoids as are worthwhile, or if the
///         frame is no smaller than on its own
[[nodiscard]] std::optional<Conversion> continueTo(const Job& job, double psnr);

}  // namespace esvr::convert
