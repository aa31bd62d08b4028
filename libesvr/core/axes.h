#pragma once
/// The components of a coordinate by number: 0 is x, 1 is y, 2 is z.

#include <cstdint>

#include "esvr/coord.h"

namespace esvr {

inline constexpr std::int32_t Coord::*kAxes[] = {&Coord::x, &Coord::y, &Coord::z};

}  // namespace esvr
