#pragma once
/// A tone curve of values: large values are compressed like a logarithm, small ones are kept as they are.
/// Errors of the coded values then are about relative ones, as the eye sees them in smoke.

#include <cmath>

#include "esvr/ellipsoids.h"

namespace esvr {

/// The curve u = s asinh(v / s), which is odd and smooth and has the slope 1 at 0. It maps a value v to
/// its tone u. Values are about linear below s, and about logarithmic above it. docs/math.md, "Tone
/// curve", has its derivatives and its rounding errors.
struct ToneCurve {
  float scale = 0.0f;  ///< s, value units; 0: no curve, the tone is the value

  [[nodiscard]] bool isOn() const { return scale > 0.0f; }

  /// \return the tone of a value, rounded from float64
  [[nodiscard]] float of(float value) const {
    if (!isOn()) return value;
    const double s = scale;
    return float(s * std::asinh(double(value) / s));
  }

  /// \return the value of a tone; infinite if it is beyond float32. The host rounds it from float64, so that
  ///         readers agree whatever their mathematical library; a device computes it in float32.
  [[nodiscard]] ESVR_HD float value(float tone) const {
    if (!(scale > 0.0f)) return tone;
#ifdef __CUDA_ARCH__
    return scale * sinhf(tone / scale);
#else
    const double s = scale;
    return float(s * std::sinh(double(tone) / s));
#endif
  }

  friend bool operator==(const ToneCurve&, const ToneCurve&) = default;
};

}  // namespace esvr
