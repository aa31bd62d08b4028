#pragma once
/// A transfer function sampled, with opacities for the step: what a renderer asks for every sample.

#include <vector>

#include "esvr/render.h"

namespace esvr {

/// Not premultiplied.
struct Classified {
  float r, g, b, alpha;
};

class TransferTable {
 public:
  /// \param length  of a step, in units of the length that opacities are given for
  TransferTable(const TransferFunction& function, double length);

  [[nodiscard]] Classified operator()(float value) const {
    if (!(value == value)) return nan_;
    const double place =
        scale_ == kNoExtent ? (value < low_ ? 0.0 : kIntervals) : (double(value) - low_) * scale_;
    if (place <= 0.0) return entries_.front();
    if (place >= kIntervals) return entries_.back();
    const int i = int(place);
    return between(entries_[i], entries_[i + 1], float(place - i));
  }

 private:
  static constexpr int kIntervals = 4096;
  static constexpr double kNoExtent = 0.0;
  static Classified between(const Classified& a, const Classified& b, float s) {
    return {a.r + s * (b.r - a.r), a.g + s * (b.g - a.g), a.b + s * (b.b - a.b),
            a.alpha + s * (b.alpha - a.alpha)};
  }

  double low_, scale_;
  std::vector<Classified> entries_;
  Classified nan_;
};

/// Light that a ray has gathered on its way.
struct RayState {
  float r = 0.0f, g = 0.0f, b = 0.0f;
  float transmittance = 1.0f;

  void add(const Classified& sample) {
    const float weight = transmittance * sample.alpha;
    r += weight * sample.r;
    g += weight * sample.g;
    b += weight * sample.b;
    transmittance *= 1.0f - sample.alpha;
  }
};

}  // namespace esvr
