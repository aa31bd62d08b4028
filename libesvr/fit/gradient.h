#pragma once
/// The derivatives by an ellipsoid's parameters, from the moments of its pairs. The arithmetic is
/// for host and device.

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

}  // namespace esvr
