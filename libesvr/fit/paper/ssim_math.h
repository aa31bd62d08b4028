#pragma once
/// 1 - SSIM of one window and its derivatives (paper_loss.h), for host and device.

#include "esvr/ellipsoids.h"
#include "field/ssim_window.h"

namespace esvr {

/// Weighted means over one window of the target t and the residual r = prediction - target.
struct WindowMoments {
  double t, tt, r, rr, tr;
};

/// 1 - SSIM of one window, which is in [0, 2] and exactly 0 if r is zero, and its derivatives (see
/// WindowGradients).
struct Dissimilarity {
  double value, byR;
  float byRr, byTr;
};

/// Clamps a variance to 0 from below; NaN stays NaN.
ESVR_HD inline double notNegative(double variance) { return variance < 0.0 ? 0.0 : variance; }

ESVR_HD inline Dissimilarity dissimilarity(const WindowMoments& m, const SsimConstants& constants) {
  const double meanP = m.t + m.r;
  const double varianceT = notNegative(m.tt - m.t * m.t);
  const double varianceR = notNegative(m.rr - m.r * m.r);
  const double covariance = m.tr - m.t * m.r;
  const double varianceP = notNegative(varianceT + 2.0 * covariance + varianceR);

  const double byMeans = 1.0 / (meanP * meanP + m.t * m.t + constants.c1);
  const double byVariances = 1.0 / (varianceP + varianceT + constants.c2);
  const double l = m.r * m.r * byMeans, c = varianceR * byVariances;

  Dissimilarity d;
  d.value = l + c - l * c;
  d.byRr = float((1.0 - l) * (1.0 - c) * byVariances * constants.c2);
  d.byTr = float(-2.0 * (1.0 - l) * c * byVariances * constants.c2);
  // uses the rounded byRr and byTr, so that the sums of a flat region still cancel
  d.byR = 2.0 * (1.0 - c) * (m.r - l * meanP) * byMeans -
          (2.0 * m.r * double(d.byRr) + m.t * double(d.byTr)) * (1.0 / constants.c2);
  return d;
}

}  // namespace esvr
