#pragma once
/// Morton keys, in which the bits of three coordinates alternate.

#include <cstdint>

namespace esvr {

/// Spreads the lowest 21 bits, so that two zero bits lie between neighbours.
constexpr std::uint64_t spreadBits(std::uint64_t v) {
  v = (v | v << 32) & 0x1f00000000ffff;
  v = (v | v << 16) & 0x1f0000ff0000ff;
  v = (v | v << 8) & 0x100f00f00f00f00f;
  v = (v | v << 4) & 0x10c30c30c30c30c3;
  v = (v | v << 2) & 0x1249249249249249;
  return v;
}

/// The inverse of spreadBits: takes every third bit, from the lowest.
constexpr std::uint32_t gatherBits(std::uint64_t v) {
  v &= 0x1249249249249249;
  v = (v | v >> 2) & 0x10c30c30c30c30c3;
  v = (v | v >> 4) & 0x100f00f00f00f00f;
  v = (v | v >> 8) & 0x1f0000ff0000ff;
  v = (v | v >> 16) & 0x1f00000000ffff;
  v = (v | v >> 32) & 0x1fffff;
  return std::uint32_t(v);
}

}  // namespace esvr
