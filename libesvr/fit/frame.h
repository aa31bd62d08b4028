#pragma once
/// Integer frames: float32 positions are relative to a near frame, so that their precision does not
/// depend on the extent of the grid.

#include <array>
#include <cmath>

#include "esvr/ellipsoids.h"
#include "esvr/kernel.h"

namespace esvr {

/// Origin of the chunk that contains a position.
ESVR_HD inline Coord frameOf(const std::array<double, 3>& center) {
  const auto snap = [](double v) {
    return std::int32_t(std::floor(v / kChunkExtent)) * kChunkExtent;
  };
  return {snap(center[0]), snap(center[1]), snap(center[2])};
}

ESVR_HD inline std::array<double, 3> inFrame(const std::array<double, 3>& center, Coord frame) {
  return {center[0] - frame.x, center[1] - frame.y, center[2] - frame.z};
}

ESVR_HD inline std::array<float, 3> cornerIn(Coord frame, Coord corner) {
  const Coord local = corner - frame;
  return {float(local.x), float(local.y), float(local.z)};
}

}  // namespace esvr
