#pragma once
/// Makes random fields for tests, which are the same on every machine.

#include <cmath>
#include <cstdint>

#include "esvr/ellipsoids.h"

namespace esvr::test {

/// SplitMix64, a generator of well-mixed numbers. No distribution of a library is used.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  /// A uniform number in [low, high).
  double operator()(double low, double high) {
    state_ += 0x9e3779b97f4a7c15ull;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    z ^= z >> 31;
    return low + (high - low) * double(z >> 11) * 0x1p-53;
  }

 private:
  std::uint64_t state_;
};

struct RandomFieldOptions {
  std::size_t count = 40;
  double extent = 40.0;    ///< centers lie in [0, extent)^3
  double smallest = 0.5;   ///< shortest scale, voxels
  double aspect = 4.0;     ///< longest scale / shortest scale
  double intensity = 1.0;  ///< intensities lie in [-intensity, intensity)
  float kappa = 2.0f;
  Coord origin{};
  std::uint64_t seed = 7;
};

inline void addRandomEllipsoid(Ellipsoids& e, std::size_t i, const RandomFieldOptions& o,
                               Random& random) {
  for (auto& c : e.center) c[i] = float(random(0.0, o.extent));
  for (auto& s : e.logScale)
    s[i] = float(std::log(o.smallest) + random(0.0, 1.0) * std::log(o.aspect));
  double q[4], norm = 0.0;
  for (double& v : q) v = random(-1.0, 1.0), norm += v * v;
  for (int a = 0; a < 4; ++a) e.rotation[a][i] = float(q[a] / std::sqrt(norm));
  e.intensity[i] = float(random(-o.intensity, o.intensity));
}

inline Field randomField(const RandomFieldOptions& o) {
  Field field;
  field.kernel.kappa = o.kappa;
  field.chunks.resize(1);
  field.chunks[0].origin = o.origin;
  field.chunks[0].ellipsoids.resize(o.count);
  Random random(o.seed);
  for (std::size_t i = 0; i < o.count; ++i)
    addRandomEllipsoid(field.chunks[0].ellipsoids, i, o, random);
  return field;
}

inline double intensitySum(const Field& field) {
  double sum = 0.0;
  for (const auto& chunk : field.chunks)
    for (const float i : chunk.ellipsoids.intensity) sum += std::abs(double(i));
  return sum;
}

}  // namespace esvr::test
