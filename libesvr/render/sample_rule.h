#pragma once
/// The rule that combines the samples of a ray into a pixel. The code is compiled for host and
/// device.

#include "esvr/render.h"
#include "render/transfer_table.h"

namespace esvr {

/// The state of a ray while its samples are added. The meaning of r, g and b depends on the mode:
///  - kComposite: the color so far, premultiplied by opacity;
///  - kMaximum: r is the largest value, g the number of values;
///  - kAverage: r is the sum of the values, g their number;
///  - kDepth: r is the distance, g is 1 once the distance is known.
struct alignas(16) RayState {
  float r = 0.0f, g = 0.0f, b = 0.0f;
  float transmittance = 1.0f;
};

/// The color of a pixel, which is premultiplied except in RenderMode::kDepth, or of a sample, whose
/// meaning SampleRule::prepared() defines.
struct alignas(16) PixelColor {
  float r, g, b, alpha;
};

/// The parameters that all rays of a picture share.
struct SampleRule {
  static constexpr float kHalf = 0.5f;  ///< share of the light at which RenderMode::kDepth stops

  TransferTableView table;
  RenderMode mode;
  float background;  ///< background value of the field or volume
  float minTransmittance;
  float step;

  /// False if no further sample can change the pixel (early ray termination).
  [[nodiscard]] ESVR_HD bool open(const RayState& ray) const {
    return !(ray.transmittance < minTransmittance) && !(mode == RenderMode::kDepth && ray.g > 0.0f);
  }

  /// Turns a value into what add() takes. In kComposite and kDepth it is the value's color, not
  /// premultiplied. In kMaximum and kAverage, r is the value itself and alpha is 1. A sample with
  /// an alpha of 0 does not change the ray.
  [[nodiscard]] ESVR_HD PixelColor prepared(float value) const {
    if (mode == RenderMode::kMaximum || mode == RenderMode::kAverage)
      return {value, 0.0f, 0.0f, 1.0f};
    const Classified c = table(value);
    return {c.r, c.g, c.b, c.alpha};
  }

  /// \param number  number of the sample, counted from the eye
  ESVR_HD void add(RayState& ray, const PixelColor& sample, float number) const {
    if (sample.alpha == 0.0f) return;
    switch (mode) {
      case RenderMode::kComposite:
        return composite(ray, sample);
      case RenderMode::kMaximum:
        if (ray.g == 0.0f || sample.r > ray.r) ray.r = sample.r;
        ray.g += 1.0f;
        return;
      case RenderMode::kAverage:
        ray.r += sample.r, ray.g += 1.0f;
        return;
      case RenderMode::kDepth:
        ray.transmittance *= 1.0f - sample.alpha;
        if (ray.transmittance < kHalf) ray.r = number * step, ray.g = 1.0f;
        return;
    }
  }
  ESVR_HD void add(RayState& ray, float value, float number) const {
    add(ray, prepared(value), number);
  }

  /// Adds the samples that lie behind those of `ray` and were gathered in `behind`. It is not used
  /// in RenderMode::kDepth, where a ray cannot be divided into parts.
  ESVR_HD void join(RayState& ray, const RayState& behind) const {
    if (mode == RenderMode::kComposite) {
      ray.r += ray.transmittance * behind.r;
      ray.g += ray.transmittance * behind.g;
      ray.b += ray.transmittance * behind.b;
      ray.transmittance *= behind.transmittance;
    } else if (mode == RenderMode::kMaximum) {
      if (behind.g > 0.0f && (ray.g == 0.0f || behind.r > ray.r)) ray.r = behind.r;
      ray.g += behind.g;
    } else {
      ray.r += behind.r, ray.g += behind.g;
    }
  }

  [[nodiscard]] ESVR_HD PixelColor finished(const RayState& ray) const {
    switch (mode) {
      case RenderMode::kComposite:
        return {ray.r, ray.g, ray.b, 1.0f - ray.transmittance};
      case RenderMode::kMaximum:
        return ray.g > 0.0f ? colored(ray.r) : PixelColor{0.0f, 0.0f, 0.0f, 0.0f};
      case RenderMode::kAverage:
        return ray.g > 0.0f ? colored(ray.r / ray.g) : PixelColor{0.0f, 0.0f, 0.0f, 0.0f};
      case RenderMode::kDepth:
        return {ray.r, 0.0f, 0.0f, ray.g};
    }
    return {0.0f, 0.0f, 0.0f, 0.0f};
  }

 private:
  ESVR_HD static void composite(RayState& ray, const PixelColor& sample) {
    const float weight = ray.transmittance * sample.alpha;
    ray.r += weight * sample.r;
    ray.g += weight * sample.g;
    ray.b += weight * sample.b;
    ray.transmittance *= 1.0f - sample.alpha;
  }
  [[nodiscard]] ESVR_HD PixelColor colored(float value) const {
    const Classified c = table(value);
    return {c.r * c.alpha, c.g * c.alpha, c.b * c.alpha, c.alpha};
  }
};

/// The length that the opacity of a sample stands for, in units of opacityLength. In kMaximum and
/// kAverage one value stands for the whole ray, and has the opacity of the transfer function.
[[nodiscard]] inline double opacitySteps(const RenderOptions& options) {
  const bool alongRay =
      options.mode == RenderMode::kComposite || options.mode == RenderMode::kDepth;
  return alongRay ? options.step / options.opacityLength : 1.0;
}

[[nodiscard]] inline SampleRule sampleRule(const RenderOptions& o, const TransferTableView& table,
                                           float background) {
  return {table, o.mode, background, float(o.minTransmittance), float(o.step)};
}

}  // namespace esvr
