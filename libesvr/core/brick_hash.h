#pragma once
/// The hash of a brick's coordinates, for tables on host and device.

#include <cstdint>

#include "esvr/coord.h"
#include "esvr/kernel.h"

namespace esvr {

ESVR_HD inline std::uint64_t hashOf(Coord c) {
  std::uint64_t h = std::uint32_t(c.x) * 0x9e3779b97f4a7c15ull;
  h = (h ^ (h >> 29)) + std::uint32_t(c.y) * 0xbf58476d1ce4e5b9ull;
  h = (h ^ (h >> 32)) + std::uint32_t(c.z) * 0x94d049bb133111ebull;
  return h ^ (h >> 31);
}

/// The same as operator==, which nvcc 13 cannot call on the device if it is defaulted.
ESVR_HD inline bool sameBrick(Coord a, Coord b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

}  // namespace esvr
