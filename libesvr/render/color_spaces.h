#pragma once
/// Colors mixed in the spaces that ParaView offers.

#include "esvr/transfer_function.h"

namespace esvr {

/// \param s  0 gives a, 1 gives b (in ColorSpace::kStep, b throughout)
[[nodiscard]] Rgb mixed(ColorSpace space, const Rgb& a, const Rgb& b, double s);

}  // namespace esvr
