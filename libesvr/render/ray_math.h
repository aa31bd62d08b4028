#pragma once
/// Adds an ellipsoid to the samples of a ray: the math of the innermost loop, written once for
/// host and device.
///
/// In the unit frame of an ellipsoid, u = S^-1 R^T (p - center), a ray runs as o + tau v, tau
/// counted along the camera's forward. Along it
///
///     m(tau) = |o x v|^2 / |v|^2 + |v|^2 (tau - closest)^2 :
///
/// both terms are positive, so nothing cancels. v and o x v ("beside") are linear in the place of
/// the pixel; they are kept relative to the ray through the ellipsoid's center, where beside is
/// zero, so that float32 is enough for a camera at any distance.

#include "esvr/kernel.h"

namespace esvr {

inline constexpr int kBinSamples = 32;  ///< samples of a ray that are summed at once

/// KernelConstants for base 2: phi = numerator / (plateau + 2^(m log2(e) - shift)) - base.
struct RayKernel {
  float numerator, plateau, shift, base, cutoff;
};

/// An ellipsoid for the rays of any pixel. `dx` and `dy` are the pixel's place relative to
/// EllipsoidView's, in pixels.
struct RayForm {
  float along[3], alongX[3], alongY[3];     ///< v = along + dx alongX + dy alongY
  float beside[3], besideX[3], besideY[3];  ///< o x v likewise
  float offX, offY;      ///< closest approach to the center, along v, as far as v does not turn
  float gain, base;      ///< numerator and base of the kernel, times the intensity
  float plateau, shift;  ///< the kernel's
  float cutoff;
};

/// A pixel's ray, as samples count: `unit` samples for each unit of tau.
struct RayScale {
  float unit;
  float pastTile;  ///< unit less that of the middle of the tile
};

/// The samples of a bin at which the support meets a ray: from `first` to `last`, none where last
/// is less. In base 2 the exponent at sample i is `nearest` + `speed` (i - `middle`)^2.
struct RaySpan {
  int first, last;
  float middle, nearest, speed;
};

namespace ray_math {

inline constexpr float kLog2e = 1.44269504f;

ESVR_HD inline float squared(const float (&v)[3]) {
  return v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
}
ESVR_HD inline float clamped(float v, float low, float high) {
  return v < low ? low : (v > high ? high : v);
}

}  // namespace ray_math

/// \param depth        tau of the closest approach of the ray through the center
/// \param middleAhead  samples from the bin's first one to there, on the tile's middle ray
ESVR_HD inline RaySpan spanOn(const RayForm& f, float dx, float dy, const RayScale& ray,
                              float depth, float middleAhead) {
  using namespace ray_math;
  float turn[3], along[3], beside[3];
  for (int i = 0; i < 3; ++i) {
    turn[i] = dx * f.alongX[i] + dy * f.alongY[i];
    along[i] = f.along[i] + turn[i];
    beside[i] = f.beside[i] + dx * f.besideX[i] + dy * f.besideY[i];
  }
  const float along2 = squared(along), beside2 = squared(beside);
  if (!(beside2 < f.cutoff * along2)) return {0, -1, 0.0f, 0.0f, 0.0f};  // passes by
  const float inverse = 1.0f / along2, nearest = beside2 * inverse;
  const float turned = turn[0] * along[0] + turn[1] * along[1] + turn[2] * along[2];
  const float later = -(f.offX * dx + f.offY * dy + depth * turned) * inverse;
  const float middle = middleAhead + depth * ray.pastTile + later * ray.unit;
  // Rounding may have nearest just beyond the cutoff.
  const float left = f.cutoff > nearest ? f.cutoff - nearest : 0.0f;
  const float half = std::sqrt(left * inverse) * ray.unit;
  const float first = std::ceil(clamped(middle - half, 0.0f, float(kBinSamples)));
  const float last = std::floor(clamped(middle + half, -1.0f, float(kBinSamples - 1)));
  return {int(first), int(last), middle, nearest * kLog2e - f.shift,
          along2 / (ray.unit * ray.unit) * kLog2e};
}

/// intensity * phi at a sample of the span.
ESVR_HD inline float valueAt(const RayForm& f, const RaySpan& span, int sample) {
  const float t = float(sample) - span.middle;
  return f.gain / (f.plateau + std::exp2(span.nearest + span.speed * t * t)) - f.base;
}

}  // namespace esvr
