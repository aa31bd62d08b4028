#pragma once
/// Random volumes and ellipsoids for the tests of gradients and steps, and their sum in float64, by
/// its definition.

#include <algorithm>
#include <cmath>
#include <ostream>
#include <string>
#include <vector>

#include "esvr/ellipsoids.h"
#include "esvr/volume.h"
#include "field/random_field.h"
#include "fit/adam.h"
#include "fit/ellipsoid.h"
#include "fit/target.h"
#include "fit/volumes.h"

namespace esvr::test {

inline constexpr int kSide = 32;  // voxels

inline SparseVolume denseVolume() { return randomBricks(cornersOfCube(kSide / kBrickSide), 5); }

inline std::vector<Ellipsoid> randomEllipsoids(std::size_t n, double smallest, double aspect) {
  const Field field = randomField(
      {.count = n, .extent = kSide, .smallest = smallest, .aspect = aspect, .seed = 21});
  const Ellipsoids& e = field.chunks[0].ellipsoids;
  std::vector<Ellipsoid> ellipsoids;
  for (std::size_t i = 0; i < n; ++i)
    ellipsoids.push_back(
        {{e.center[0][i], e.center[1][i], e.center[2][i]}, unitFrame(e, i), e.intensity[i]});
  return ellipsoids;
}

/// m of an ellipsoid at a voxel: |L (v - mu)|^2.
inline double squaredDistance(const Ellipsoid& p, Coord v) {
  const double d[3] = {v.x - p.center[0], v.y - p.center[1], v.z - p.center[2]};
  const double* row =
      p.L.data();  // tests are not optimised, and each use of an array would be a call
  double m = 0.0;
  for (int r = 0; r < 3; ++r, row += 3) {
    const double u = row[0] * d[0] + row[1] * d[1] + row[2] * d[2];
    m += u * u;
  }
  return m;
}

inline double sumAt(const std::vector<Ellipsoid>& ellipsoids, const KernelConstants<double>& k,
                    Coord v) {
  double sum = 0.0;
  for (const Ellipsoid& p : ellipsoids) sum += p.intensity * kernelPhi(k, squaredDistance(p, v));
  return sum;
}

// ---- Scenes

struct GradientCase {
  const char* name;
  double scales[3];  ///< voxels
  float kappa;
};
inline std::ostream& operator<<(std::ostream& out, const GradientCase& c) {
  return out << c.name << ", kappa " << c.kappa;
}

/// Cases from spheres of a tenth of a voxel to a hundred voxels, with aspect ratios up to 1000.
inline std::vector<GradientCase> gradientCases() {
  std::vector<GradientCase> cases;
  for (const float kappa : {-30.0f, -3.0f, 2.0f, 5.0f, 30.0f})
    for (const GradientCase& shape :
         {GradientCase{"subvoxel", {0.1, 0.1, 0.1}, 0.0f}, GradientCase{"small", {1, 1, 1}, 0.0f},
          GradientCase{"large", {10, 10, 10}, 0.0f}, GradientCase{"huge", {100, 100, 100}, 0.0f},
          GradientCase{"usual", {2, 1, 0.6}, 0.0f}, GradientCase{"needle", {100, 0.1, 0.1}, 0.0f},
          GradientCase{"pancake", {100, 100, 0.1}, 0.0f},
          GradientCase{"blade", {100, 3, 0.1}, 0.0f}}) {
      cases.push_back(shape);
      cases.back().kappa = kappa;
    }
  return cases;
}

/// The name of a case in a test, such as "needle_kappa_minus_30".
inline std::string nameOf(const GradientCase& c) {
  return std::string(c.name) + "_kappa_" + (c.kappa < 0 ? "minus_" : "") +
         std::to_string(int(std::abs(c.kappa)));
}

/// A target with two bricks along each axis.
class SmallTarget {
 public:
  SmallTarget() : volume_(randomVolume()), target_(makeTarget(volume_, std::nullopt)) {
    // The narrow band makes other bricks count for nothing; its limits are never reached.
    target_.narrowBand = true;
    target_.lowest = -1e9, target_.highest = 1e9;
  }
  [[nodiscard]] const FitTarget& get() const { return target_; }
  static constexpr int kSide = 2 * kBrickSide;
  [[nodiscard]] Coord voxel(std::size_t v) const {
    return target_.bricks[v / kBrickVoxels] * kBrickSide + voxelLocal(int(v % kBrickVoxels));
  }

 private:
  static SparseVolume randomVolume() {
    Random random(5);
    return fullBricks(cornersOfCube(2), 0.0f, [&](Coord) { return random(-1.0, 1.0); });
  }
  SparseVolume volume_;
  FitTarget target_;
};

/// The definition of esvr/ellipsoids.h: ((1 + E) / (E + e^m) - eps) / (1 - eps) with E = e^kappa. For
/// positive kappa both terms of the quotient are divided by E, which may be infinite.
inline double phiByDefinition(double kappa, double m) {
  const double E = std::exp(kappa), eps = double(Kernel::kDefaultEpsilon);
  const double quotient = kappa > 0.0 ? (1.0 + std::exp(-kappa)) / (1.0 + std::exp(m - kappa))
                                      : (1.0 + E) / (E + std::exp(m));
  return std::max(0.0, (quotient - eps) / (1.0 - eps));
}

inline double contribution(const Ellipsoid& p, double kappa, Coord v) {
  return p.intensity * phiByDefinition(kappa, squaredDistance(p, v));
}

/// L = S^-1 R^T with a random rotation R.
inline Matrix3 randomFrame(const double (&scales)[3], Random& random) {
  double q[4], norm = 0.0;
  for (double& v : q) v = random(-1.0, 1.0), norm += v * v;
  for (double& v : q) v /= std::sqrt(norm);
  const Matrix3 R = rotationOf({q[0], q[1], q[2], q[3]});
  Matrix3 L{};
  for (int j = 0; j < 3; ++j)
    for (int a = 0; a < 3; ++a) L[3 * j + a] = R[3 * a + j] / scales[j];
  return L;
}

/// Largest error of m in float32 within the support. A displacement from the center is rounded to
/// 2^-24 of the largest coordinate D that enters it, and so are its products with the rows of L.
/// This moves a voxel by D 2^-24 / (shortest scale) in the unit frame, and changes m by 2 sqrt(m)
/// times that. About 16 such roundings enter m: for each axis those of the center, the
/// displacement, its two products and their sum. The argument m - kappa of the exponential has an
/// error of up to four roundings of kappa.
inline double errorOfM(const GradientCase& c, const Ellipsoid& p) {
  double largest = SmallTarget::kSide;
  for (const double x : p.center) largest = std::max(largest, x);
  const double radius = supportRadius(kernelConstants<double>({.kappa = c.kappa}));
  const double shortest = std::min({c.scales[0], c.scales[1], c.scales[2]});
  return 0x1p-24 * (16.0 * 2.0 * radius * largest / shortest + 4.0 * std::abs(double(c.kappa)));
}

/// An ellipsoid for which the kernel is near 1/2 at a voxel of the target, so that no derivative is
/// close to 0: m differs from that of 1/2 by at most a tenth, and at most 1, the width of an edge. Its center may lie far outside.
inline Ellipsoid atAVoxel(const GradientCase& c, Random& random) {
  Ellipsoid p{{}, randomFrame(c.scales, random), random(0.1, 0.5) * (random(0, 1) < 0.3 ? -1 : 1)};
  const double half = kernelWidth(kernelConstants<double>({.kappa = c.kappa})).m;
  double u[3], norm = 0.0;
  for (double& v : u) v = random(-1.0, 1.0), norm += v * v;
  const double off = std::min(0.1 * half, 1.0);
  const double radius = std::sqrt((half + random(-off, off)) / norm);
  const Matrix3 F = inverse(p.L);
  for (int a = 0; a < 3; ++a) {
    const double voxel = std::floor(random(0.0, SmallTarget::kSide));
    p.center[a] = voxel - radius * (F[3 * a] * u[0] + F[3 * a + 1] * u[1] + F[3 * a + 2] * u[2]);
  }
  return p;
}

/// True if a voxel is so close to the end of the support, where derivatives jump, that rounding
/// decides on which side it lies. Also true if the center lies below 0: its frame then begins 4096
/// voxels before, and large coordinates leave few digits to test.
inline bool isUnfit(const GradientCase& c, const Ellipsoid& p, const SmallTarget& target) {
  if (*std::min_element(p.center.begin(), p.center.end()) < 0.0) return true;
  const double cutoff = kernelConstants<double>({.kappa = c.kappa}).cutoff;
  for (std::size_t v = 0; v < target.get().values.size(); ++v)
    if (std::abs(squaredDistance(p, target.voxel(v)) - cutoff) < errorOfM(c, p)) return true;
  return false;
}

inline std::vector<Ellipsoid> ellipsoidsOf(const GradientCase& c, const SmallTarget& target) {
  constexpr std::size_t kCount = 4;
  Random random(31);
  std::vector<Ellipsoid> ellipsoids;
  while (ellipsoids.size() < kCount) {
    const Ellipsoid p = atAVoxel(c, random);
    if (!isUnfit(c, p, target)) ellipsoids.push_back(p);
  }
  return ellipsoids;
}

/// Largest error of float32 gradients relative to the sum of the magnitudes of their terms. If m
/// changes by 1, no derivative of the kernel changes by more than its own size. Sums of up to 4096
/// terms in eight lanes, brick by brick, add about 2^-24 for each of 64 rows.
inline double toleranceOf(const GradientCase& c, const Ellipsoid& p) {
  return 64 * 0x1p-24 + errorOfM(c, p);
}

/// The error of differences is 2^-53 / step plus the square of the step. No voxel lies within a
/// step of the end of a support.
inline constexpr double kDifferenceStep = 1e-6;

inline Ellipsoid moved(Ellipsoid p, const ParameterVector& direction, double step) {
  ParameterVector s = direction;
  for (double& v : s) v *= step;
  applyStep(p, s);
  return p;
}

/// The derivative of the loss by the sum at every voxel, V - target, in float64.
inline std::vector<double> residualsOf(const SmallTarget& target, const GradientCase& c,
                                       const std::vector<Ellipsoid>& ellipsoids) {
  std::vector<double> r(target.get().values.size());
  for (std::size_t v = 0; v < r.size(); ++v) {
    r[v] = -double(target.get().values[v]);
    for (const Ellipsoid& p : ellipsoids) r[v] += contribution(p, c.kappa, target.voxel(v));
  }
  return r;
}

/// The product <g, dV> and the sum of the magnitudes of its terms.
struct Projection {
  double sum = 0.0, magnitude = 0.0;
};
inline Projection project(const SmallTarget& target, const std::vector<double>& g,
                          const Ellipsoid& p, const ParameterVector& direction, double kappa,
                          double byKappa) {
  const Ellipsoid ahead = moved(p, direction, kDifferenceStep);
  const Ellipsoid behind = moved(p, direction, -kDifferenceStep);
  Projection result;
  for (std::size_t v = 0; v < g.size(); ++v) {
    const Coord at = target.voxel(v);
    const double term = g[v] *
                        (contribution(ahead, kappa + kDifferenceStep * byKappa, at) -
                         contribution(behind, kappa - kDifferenceStep * byKappa, at)) /
                        (2.0 * kDifferenceStep);
    result.sum += term;
    result.magnitude += std::abs(term);
  }
  return result;
}

inline ParameterVector unit(int parameter) {
  ParameterVector direction{};
  direction[parameter] = 1.0;
  return direction;
}

/// The gradients of an ellipsoid by differences: by each parameter alone, and by kappa at fixed scales.
struct Differences {
  double by[kParameters + 1];
  double magnitude = 0.0;  ///< largest sum of the magnitudes of the terms of one of them
};
inline Differences differencesOf(const SmallTarget& target, const GradientCase& c,
                                 const Ellipsoid& p, const std::vector<double>& g) {
  Differences all{};
  for (int n = 0; n <= kParameters; ++n) {
    const bool kappa = n == kParameters;
    const Projection by =
        project(target, g, p, kappa ? ParameterVector{} : unit(n), c.kappa, kappa);
    all.by[n] = by.sum;
    all.magnitude = std::max(all.magnitude, by.magnitude);
  }
  return all;
}

}  // namespace esvr::test
