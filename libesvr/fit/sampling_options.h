#pragma once
/// What voxels are drawn for, and the numbers a draw is made of, for host and device.

#include <cstddef>
#include <cstdint>

#include "esvr/kernel.h"

namespace esvr {

/// Which errors a new ellipsoid can mend: one of positive intensity fills where V is too low.
struct SignsAllowed {
  bool positive = true, negative = false;
  [[nodiscard]] ESVR_HD bool mends(float residual) const {
    return residual < 0.0f ? positive : negative;
  }
};

/// Squared residual that new ellipsoids can mend.
ESVR_HD inline double sampleEnergy(float residual, SignsAllowed signs) {
  return signs.mends(residual) ? double(residual) * double(residual) : 0.0;
}

/// A uniform number in [0, 1) for draw `n` of a seed.
ESVR_HD inline double sampleUniform(std::uint64_t seed, std::uint64_t n) {
  std::uint64_t z =
      seed * 0x9e3779b97f4a7c15ull + n * 0xbf58476d1ce4e5b9ull + 0x94d049bb133111ebull;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
  return double((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

struct SamplingOptions {
  std::size_t count = 0;
  std::size_t targetBricks = 0;  ///< voxels are drawn from the first so many bricks of the residual
  SignsAllowed signs{};
  std::uint64_t seed = 1;
};

}  // namespace esvr
