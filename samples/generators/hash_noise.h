#pragma once
/// Random numbers and noise that are the same on every machine. They use integer hashes and exact
/// float64 operations, but no distributions or transcendental functions of the standard library.

#include <cstdint>

#include "generators/vec3.h"

namespace esvr::samples {

/// Mixes all bits of a counter and a seed.
[[nodiscard]] std::uint64_t hash(std::uint64_t seed, std::uint64_t counter);

/// A stream of random numbers, of which the n-th is a hash of n.
class Random {
 public:
  explicit Random(std::uint64_t seed) : seed_(seed) {}

  [[nodiscard]] double uniform();  ///< the next number, uniform in [0, 1)
  [[nodiscard]] double uniform(double low, double high) { return low + (high - low) * uniform(); }
  [[nodiscard]] Vec3 inCube(double low, double high);
  [[nodiscard]] Vec3 direction();  ///< uniform on the unit sphere

 private:
  std::uint64_t seed_, counter_ = 0;
};

/// Smooth noise with features of size 1, in [-1, 1].
[[nodiscard]] double noise(std::uint64_t seed, Vec3 p);

/// Largest slope of noise along an axis: its range times the largest slope of the fade, 15 / 8.
inline constexpr double kNoiseSlope = 2.0 * 15.0 / 8.0;

/// Sum of noise with features of sizes 1, 1/2, 1/4, ... and weights 1, 1/2, 1/4, ..., scaled to
/// [-1, 1].
[[nodiscard]] double fractalNoise(std::uint64_t seed, Vec3 p, int octaves);

}  // namespace esvr::samples
