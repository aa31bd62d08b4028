#pragma once
/// Options and random numbers of the sampling of voxels, for host and device.

#include <cstddef>
#include <cstdint>

#include "esvr/kernel.h"

namespace esvr {

/// The allowed signs of a seed's intensity. A positive intensity reduces the error where V is too
/// low.
struct SignsAllowed {
  bool positive = true, negative = false;
  [[nodiscard]] ESVR_HD bool mends(float residual) const {
    return residual < 0.0f ? positive : negative;
  }
};

/// The squared residual if a seed of an allowed sign can reduce it, else 0.
ESVR_HD inline double sampleEnergy(float residual, SignsAllowed signs) {
  return signs.mends(residual) ? double(residual) * double(residual) : 0.0;
}

/// A uniform random number in [0, 1) for draw `n` of a random seed.
ESVR_HD inline double sampleUniform(std::uint64_t seed, std::uint64_t n) {
  std::uint64_t z =
      seed * 0x9e3779b97f4a7c15ull + n * 0xbf58476d1ce4e5b9ull + 0x94d049bb133111ebull;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
  return double((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

struct SamplingOptions {
  std::size_t count = 0;
  std::size_t targetBricks = 0;  ///< number of bricks, the first of the residual, that are sampled
  SignsAllowed signs{};
  std::uint64_t seed = 1;
};

}  // namespace esvr
