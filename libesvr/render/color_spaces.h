#pragma once
/// Interpolates colors in the color spaces that ParaView offers.

#include "esvr/transfer_function.h"

namespace esvr {

/// \param s  weight of b, from 0 to 1. In ColorSpace::kStep the result is always b
[[nodiscard]] Rgb mixed(ColorSpace space, const Rgb& a, const Rgb& b, double s);

}  // namespace esvr
