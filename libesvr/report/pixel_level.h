#pragma once
/// Levels of a channel with 8 bits.

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace esvr::report {

/// The level of a color from 0 to 1. Colors outside this range are clamped.
inline std::uint8_t levelOf(double color) {
  constexpr double kMaxLevel = 255.0;
  return std::uint8_t(std::lround(std::clamp(color, 0.0, 1.0) * kMaxLevel));
}

}  // namespace esvr::report
