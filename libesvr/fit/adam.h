#pragma once
/// The derivatives by an ellipsoid's parameters, from the moments of its pairs. And
/// Adam (Kingma and Ba 2015) on the parameters of ellipsoids, each in its own frame. The
/// arithmetic of one ellipsoid is for host and device.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>

#include "field/brick_kernels.h"
#include "fit/ellipsoid.h"

namespace esvr {

/// The kernel's constants in float32, for inner loops.
[[nodiscard]] ESVR_HD inline KernelConstants<float> narrowed(const KernelConstants<double>& k) {
  return {float(k.shift), float(k.numerator), float(k.plateau),
          float(k.base),  float(k.slope),     float(k.cutoff)};
}

/// The derivatives of one ellipsoid.
struct EllipsoidGradient {
  ParameterVector byParameter;  ///< gradient of half the sum of squares, or of a given loss
  double phi2;                  ///< sum over voxels of phi^2: second derivative by the intensity
  double byKappa;               ///< derivative by the kernel's edge at fixed scales
};

/// Moments of an ellipsoid's pairs, summed in float64 in the pairs' order.
struct PairSums {
  double w0x, w0z, w0xx, w0xz, w0zz, w1, w1x, w1z, w2, rPhi, phi2, rEdge;
};

/// With the position u = px dx + pz dz + ly t in the unit frame,
///
///     dL/d delta = -2 I sum r phi' u
///     dL/d A_jj  = -2 I sum r phi' u_j^2,   dL/d A_jk = -4 I sum r phi' u_j u_k   (j != k)
///     dL/d I     = sum r phi
[[nodiscard]] ESVR_HD inline ParameterVector parameterGradient(const LineForm& f,
                                                               const PairSums& s) {
  const auto first = [&](int j) {
    return double(f.px[j]) * s.w0x + double(f.pz[j]) * s.w0z + double(f.ly[j]) * s.w1;
  };
  const auto second = [&](int j, int k) {
    const double pxj = f.px[j], pxk = f.px[k], pzj = f.pz[j], pzk = f.pz[k], lyj = f.ly[j],
                 lyk = f.ly[k];
    return pxj * pxk * s.w0xx + (pxj * pzk + pzj * pxk) * s.w0xz + pzj * pzk * s.w0zz +
           (pxj * lyk + lyj * pxk) * s.w1x + (pzj * lyk + lyj * pzk) * s.w1z + lyj * lyk * s.w2;
  };
  const double c = -2.0 * f.intensity;
  return {c * first(0),         c * first(1),
          c * first(2),         c * second(0, 0),
          c * second(1, 1),     c * second(2, 2),
          2 * c * second(0, 1), 2 * c * second(0, 2),
          2 * c * second(1, 2), s.rPhi};
}

/// All derivatives of an ellipsoid. \param slope  KernelConstants::slope of its kernel
[[nodiscard]] ESVR_HD inline EllipsoidGradient ellipsoidGradient(const LineForm& f,
                                                                 const PairSums& s, double slope) {
  return {parameterGradient(f, s), s.phi2, double(f.intensity) * slope * s.rEdge};
}

/// dL/dkappa at a fixed half width. As kappa grows, the logarithms of the scales shrink by
/// d ln m / 2, which is the direction of the three diagonal parameters of A.
/// \param logMByKappa  see KernelWidth
[[nodiscard]] ESVR_HD inline double edgeGradient(const EllipsoidGradient& gradient,
                                                 double logMByKappa) {
  const ParameterVector& g = gradient.byParameter;
  return gradient.byKappa - 0.5 * logMByKappa * (g[3] + g[4] + g[5]);
}

/// Growth of the sum of squares if the ellipsoid is removed:
///
///     sum (r - I phi)^2 - r^2 = I^2 sum phi^2 - 2 I sum r phi
[[nodiscard]] ESVR_HD inline double removalError(double intensity, double phi2, double rPhi) {
  return intensity * (intensity * phi2 - 2.0 * rPhi);
}

// ---- Steps

/// Largest steps of the parameters in one iteration.
struct StepSizes {
  double position = 0.1;   ///< motion along an axis, in its scale
  double shape = 0.1;      ///< relative change of a scale, and shear
  double intensity = 0.1;  ///< relative change of the intensity (see largestStep)
  [[nodiscard]] ESVR_HD StepSizes scaled(double f) const {
    return {position * f, shape * f, intensity * f};
  }
};

struct AdamOptions {
  double beta1 = 0.9;
  double beta2 = 0.95;  ///< a short average, since the loss has no noise
};

/// First and second moments of one ellipsoid's gradient.
struct AdamState {
  std::array<float, kParameters> m{}, v{};
  std::uint32_t steps = 0;  ///< steps since the ellipsoid was placed
};

/// Limits of the parameters.
struct EllipsoidLimits {
  double smallestScale, largestScale;        ///< voxels
  double lowestIntensity, highestIntensity;  ///< units of the target
};

/// The factors of Adam's direction, whose components are about 1 at most.
ESVR_HD inline ParameterVector largestStep(const Ellipsoid& p, const StepSizes& s) {
  // lets intensities near zero move; units of the target, whose largest magnitude is 1
  constexpr double kIntensityFloor = 0.01;
  const double magnitude = std::abs(p.intensity);
  const double i = s.intensity * (magnitude > kIntensityFloor ? magnitude : kIntensityFloor);
  return {s.position, s.position, s.position, s.shape, s.shape,
          s.shape,    s.shape,    s.shape,    s.shape, i};
}

/// Updates the moments and returns the step, `largest` times Adam's direction.
ESVR_HD inline ParameterVector adamDirection(AdamState& state, const ParameterVector& gradient,
                                             const AdamOptions& o, const ParameterVector& largest) {
  // The squares of smaller gradients vanish in float32; this avoids a division by zero.
  constexpr double kEpsilon = 1e-18;
  ++state.steps;
  const double c1 = 1.0 / (1.0 - std::pow(o.beta1, double(state.steps)));
  const double c2 = 1.0 / (1.0 - std::pow(o.beta2, double(state.steps)));
  ParameterVector d;
  for (int k = 0; k < kParameters; ++k) {
    const double g = gradient[k];
    state.m[k] = float(o.beta1 * state.m[k] + (1.0 - o.beta1) * g);
    state.v[k] = float(o.beta2 * state.v[k] + (1.0 - o.beta2) * g * g);
    d[k] = -largest[k] * c1 * state.m[k] / (std::sqrt(c2 * state.v[k]) + kEpsilon);
  }
  return d;
}

/// Takes a step and clamps the parameters to the limits.
ESVR_HD inline void moveWithin(Ellipsoid& p, const ParameterVector& step,
                               const EllipsoidLimits& limits) {
  applyStep(p, step);
  p.intensity = std::clamp(p.intensity, limits.lowestIntensity, limits.highestIntensity);
  clampScales(p, limits.smallestScale, limits.largestScale);
}

/// What a step of Adam needs besides the ellipsoids and their gradients.
struct AdamStep {
  StepSizes sizes;
  AdamOptions options;
  EllipsoidLimits limits;
};

/// Takes one step with every ellipsoid, on the CPU.
void adamStep(std::span<Ellipsoid> ellipsoids, std::span<AdamState> states,
              std::span<const EllipsoidGradient> gradients, const AdamStep& step);

}  // namespace esvr
