#pragma once
/// The search for the smallest grid that reaches a PSNR.

#include "convert/attempt.h"

namespace esvr::convert {

/// Makes a short fit and then full fits, each with a number of ellipsoids that follows from the
/// PSNR of the fits before. If the PSNR is out of reach, the result is the best of them with
/// FitEnd::kPsnrMissed.
/// \param psnr  dB over the box
[[nodiscard]] Conversion searchPsnr(const Job& job, double psnr);

}  // namespace esvr::convert
