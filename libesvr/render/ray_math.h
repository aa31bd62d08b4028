#pragma once
/// Adds an ellipsoid to the samples of a ray. This is the math of the innermost loop, compiled for
/// host and device.
///
/// In the frame u = S^-1 R^T (p - center) of an ellipsoid (docs/math.md), a ray is a line
/// u = o + tau v. Its parameter tau is the depth along the camera's forward direction. The
/// argument m = |u|^2 of the kernel is, along the ray,
///
///     m(tau) = |o x v|^2 / |v|^2 + |v|^2 (tau - closest)^2
///
/// with the parameter `closest` of the point nearest to the center. Both terms are positive, so
/// there is no cancellation. The vectors v ("along") and o x v ("beside") are linear functions of
/// the pixel's position. They are stored relative to the pixel whose ray goes through the
/// ellipsoid's center, where o x v is zero. Float32 is then precise enough for a camera at any
/// distance.

#include "esvr/kernel.h"

namespace esvr {

inline constexpr int kBinSamples = 32;  ///< consecutive samples of a ray that make a bin

/// The constants of a kernel in base 2: phi(m) = numerator / (plateau + 2^(m log2(e) - shift)) -
/// base for m < cutoff. KernelConstants (kernel.h) has them in base e.
struct RayKernel {
  float numerator, plateau, shift, base, cutoff;
};

/// An ellipsoid in the form that all rays of a picture use. dx and dy are the distance in pixels
/// from the reference pixel of its EllipsoidView.
struct RayForm {
  float along[3], alongX[3], alongY[3];     ///< v = along + dx alongX + dy alongY
  float beside[3], besideX[3], besideY[3];  ///< o x v = beside + dx besideX + dy besideY
  float offX, offY;      ///< change of u . v at `depth` for dx and dy, without the turn of the ray
  float gain, base;      ///< numerator and base of the kernel, times the intensity
  float plateau, shift;  ///< as in RayKernel
  float cutoff;          ///< as in RayKernel
};

/// The number of samples per unit of tau on a pixel's ray.
struct RayScale {
  float unit;
  float pastTile;  ///< `unit` minus the value on the ray through the middle of the tile
};

/// The samples of a bin that lie in an ellipsoid's support: `first` to `last`, none if last <
/// first. At sample i the exponent in the kernel is, in base 2, nearest + speed (i - middle)^2.
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

/// \param depth        tau of the point nearest to the center, on the reference pixel's ray
/// \param middleAhead  number of samples from the bin's first one to the depth `depth`, on the ray
///                     through the middle of the tile
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
  if (!(beside2 < f.cutoff * along2)) return {0, -1, 0.0f, 0.0f, 0.0f};  // misses the support
  const float inverse = 1.0f / along2, nearest = beside2 * inverse;
  const float turned = turn[0] * along[0] + turn[1] * along[1] + turn[2] * along[2];
  const float later = -(f.offX * dx + f.offY * dy + depth * turned) * inverse;
  const float middle = middleAhead + depth * ray.pastTile + later * ray.unit;
  // Rounding may put `nearest` just beyond the cutoff.
  const float left = f.cutoff > nearest ? f.cutoff - nearest : 0.0f;
  const float half = std::sqrt(left * inverse) * ray.unit;
  const float first = std::ceil(clamped(middle - half, 0.0f, float(kBinSamples)));
  const float last = std::floor(clamped(middle + half, -1.0f, float(kBinSamples - 1)));
  return {int(first), int(last), middle, nearest * kLog2e - f.shift,
          along2 / (ray.unit * ray.unit) * kLog2e};
}

/// The value intensity * phi at a sample of the span.
ESVR_HD inline float valueAt(const RayForm& f, const RaySpan& span, int sample) {
  const float t = float(sample) - span.middle;
  return f.gain / (f.plateau + std::exp2(span.nearest + span.speed * t * t)) - f.base;
}

}  // namespace esvr
