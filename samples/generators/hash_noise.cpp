#include "generators/hash_noise.h"

#include <cmath>

namespace esvr::samples {
namespace {

constexpr std::uint64_t kGolden = 0x9e3779b97f4a7c15u;  // 2^64 / golden ratio, spreads counters

/// Stafford's mixer 13 of the 64-bit finaliser of MurmurHash3.
std::uint64_t mix(std::uint64_t h) {
  h = (h ^ (h >> 30)) * 0xbf58476d1ce4e5b9u;
  h = (h ^ (h >> 27)) * 0x94d049bb133111ebu;
  return h ^ (h >> 31);
}

double unit(std::uint64_t h) { return double(h >> 11) * 0x1p-53; }

/// Odd numbers near 2^64 / p, 2^64 / p^2 and 2^64 / p^3 with p^4 = p + 1. Their multiples fill the
/// range evenly, so that one mixing step suffices for three coordinates.
constexpr std::uint64_t kStrideX = 0xd1b54a32d192ed03u;
constexpr std::uint64_t kStrideY = 0xabc98388fb8fac03u;
constexpr std::uint64_t kStrideZ = 0x8cb92ba72f3d8dd7u;

double latticeValue(std::uint64_t start, std::int64_t x, std::int64_t y, std::int64_t z) {
  const std::uint64_t place =
      std::uint64_t(x) * kStrideX + std::uint64_t(y) * kStrideY + std::uint64_t(z) * kStrideZ;
  return 2.0 * unit(mix(start + place)) - 1.0;
}

/// A weight whose first two derivatives vanish at 0 and 1, so that noise shows no lattice.
double fade(double t) { return t * t * t * (t * (t * 6.0 - 15.0) + 10.0); }

double mixLinear(double a, double b, double t) { return a + (b - a) * t; }

}  // namespace

std::uint64_t hash(std::uint64_t seed, std::uint64_t counter) {
  return mix(mix(seed + kGolden) ^ (counter * kGolden));
}

double Random::uniform() { return unit(hash(seed_, counter_++)); }

Vec3 Random::inCube(double low, double high) {
  const double x = uniform(low, high), y = uniform(low, high), z = uniform(low, high);
  return {x, y, z};
}

Vec3 Random::direction() {
  for (;;) {
    const Vec3 v = inCube(-1.0, 1.0);
    const double square = dot(v, v);
    if (square > 1e-6 && square <= 1.0) return v * (1.0 / std::sqrt(square));
  }
}

double noise(std::uint64_t seed, Vec3 p) {
  const double fx = std::floor(p.x), fy = std::floor(p.y), fz = std::floor(p.z);
  const auto x = std::int64_t(fx), y = std::int64_t(fy), z = std::int64_t(fz);
  const double tx = fade(p.x - fx), ty = fade(p.y - fy), tz = fade(p.z - fz);
  const std::uint64_t start = mix(seed + kGolden);
  const auto alongZ = [&](int dx, int dy) {
    return mixLinear(latticeValue(start, x + dx, y + dy, z),
                     latticeValue(start, x + dx, y + dy, z + 1), tz);
  };
  return mixLinear(mixLinear(alongZ(0, 0), alongZ(0, 1), ty),
                   mixLinear(alongZ(1, 0), alongZ(1, 1), ty), tx);
}

double fractalNoise(std::uint64_t seed, Vec3 p, int octaves) {
  double sum = 0.0, weight = 1.0, weights = 0.0;
  for (int octave = 0; octave < octaves; ++octave) {
    sum += weight * noise(seed + std::uint64_t(octave), p);
    weights += weight;
    weight *= 0.5;
    p = p * 2.0;
  }
  return sum / weights;
}

}  // namespace esvr::samples
