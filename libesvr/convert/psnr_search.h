#pragma once
/// The smallest grid of a PSNR.

#include "convert/attempt.h"

namespace esvr::convert {

/// After a short fit, whole ones whose numbers of ellipsoids follow from what the ones before
/// reached. Where the PSNR is out of reach the best of them, marked kPsnrMissed.
/// \param psnr  dB over the box
[[nodiscard]] Conversion searchPsnr(const Job& job, double psnr);

}  // namespace esvr::convert
