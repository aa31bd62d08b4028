#pragma once
/// The rule that combines the samples of a ray into a pixel. The code is compiled for host and
/// device.

#include <cstdint>

#include "esvr/render.h"
#include "render/shading.h"
#include "render/transfer_table.h"

namespace esvr {

/// A sample's place in the sequence of a ray's samples.
struct SampleNumber {
  float fromEye;  ///< number of the sample, counted from the eye
  /// The same, counted from any sample of the ray and modulo 2^32. Unlike the float, it tells whether
  /// two samples are consecutive however far away the eye is.
  std::uint32_t index;
};
/// \param number  of the sample, counted from where rays begin
/// \param before  samples between the eye and that place
[[nodiscard]] inline SampleNumber sampleNumber(double number, double before = 0.0) {
  constexpr double kMost = 0x1p62;  // float64 does not tell neighbours apart there
  return {float(number + before), std::uint32_t(std::int64_t(number < kMost ? number : kMost))};
}

/// The state of a ray, or of a part of it, while its samples are added. The meaning of r, g and b
/// depends on the mode:
///  - kComposite: the color so far, premultiplied by opacity;
///  - kMaximum: r is the largest value, g the number of values;
///  - kAverage: r is the sum of the values, each times the step, and g the sum of the steps;
///  - kDepth: r is the distance, g is 1 once the distance is known.
/// With Classification::kPreIntegrated, the first and the last sample that were added are kept. A
/// part that lies behind other samples leaves out the light before its first sample, because it
/// depends on them; SampleRule::join() adds it.
struct alignas(16) RayState {
  static constexpr std::uint32_t kNone = 0xfffffff0u;  ///< index of no sample

  float r = 0.0f, g = 0.0f, b = 0.0f;
  float transmittance = 1.0f;
  float firstValue = 0.0f, lastValue = 0.0f;
  std::uint32_t first = 0;  ///< index of the first sample of a part; kNone: there is none yet
  std::uint32_t last = kNone;

  /// A part of a ray that lies behind other samples.
  [[nodiscard]] ESVR_HD static RayState behind() {
    RayState part;
    part.first = kNone;
    return part;
  }
};

/// The parameters that all rays of a picture share.
struct SampleRule {
  static constexpr float kHalf = 0.5f;  ///< share of the light at which RenderMode::kDepth stops

  TransferTableView table;
  RenderMode mode;
  Classification classification;
  float background;  ///< background value of the field or volume
  float minTransmittance;
  float step;

  /// False if no further sample can change the pixel (early ray termination).
  [[nodiscard]] ESVR_HD bool open(const RayState& ray) const {
    return !(ray.transmittance < minTransmittance) && !(mode == RenderMode::kDepth && ray.g > 0.0f);
  }

  /// Adds a sample that is not empty space. Samples that are left out are empty space.
  /// \param shades  rule by which colors are lit: NoShades or Shades
  template <class ShadeRule = NoShades>
  ESVR_HD void add(RayState& ray, float value, const SampleNumber& number,
                   const ShadeRule& shades = {}) const {
    if (mode == RenderMode::kMaximum) return keepLargest(ray, value, 1.0f);
    if (mode == RenderMode::kAverage) return sumUp(ray, value * step, step);
    if (classification == Classification::kPost) {
      setDistance(ray, number.fromEye * step);
      return absorb(ray, shades.ofThis(premultiplied(table(value))));
    }
    if (ray.first == RayState::kNone)
      ray.first = number.index, ray.firstValue = value;
    else
      addSegments(ray, value, number, shades);
    ray.last = number.index, ray.lastValue = value;
  }

  /// Goes on to samples that follow another rule, for example in another level of detail. Their first
  /// one is the sample that this rule has reached.
  /// \param here, there  index of that sample in the old and in the new samples
  template <class ShadeRule = NoShades>
  ESVR_HD void passOn(RayState& ray, std::uint32_t here, std::uint32_t there,
                      const ShadeRule& shades = {}) const {
    if (ray.last != here) leave(ray, shades);
    if (ray.last != RayState::kNone) ray.last = ray.last == here ? there : RayState::kNone;
  }

  /// Adds the samples that lie behind those of `ray` and were gathered in `behind`, a part that
  /// began as RayState::behind(). It is not used in RenderMode::kDepth, where a ray cannot be
  /// divided into parts.
  ESVR_HD void join(RayState& ray, const RayState& behind) const {
    if (mode == RenderMode::kMaximum) return keepLargest(ray, behind.r, behind.g);
    if (mode == RenderMode::kAverage) return sumUp(ray, behind.r, behind.g);
    if (classification == Classification::kPreIntegrated && !connect(ray, behind)) return;
    absorb(ray, {behind.r, behind.g, behind.b, 1.0f - behind.transmittance});
  }

  template <class ShadeRule = NoShades>
  [[nodiscard]] ESVR_HD PixelColor finished(RayState ray, const ShadeRule& shades = {}) const {
    if (mode == RenderMode::kMaximum || mode == RenderMode::kAverage) {
      if (!(ray.g > 0.0f)) return {0.0f, 0.0f, 0.0f, 0.0f};
      return premultiplied(table(mode == RenderMode::kMaximum ? ray.r : ray.r / ray.g));
    }
    leave(ray, shades);
    if (mode == RenderMode::kDepth) return {ray.g > 0.0f ? ray.r : 0.0f, 0.0f, 0.0f, ray.g};
    return {ray.r, ray.g, ray.b, 1.0f - ray.transmittance};
  }

 private:
  ESVR_HD static PixelColor premultiplied(const Classified& c) {
    return {c.r * c.alpha, c.g * c.alpha, c.b * c.alpha, c.alpha};
  }
  ESVR_HD static void keepLargest(RayState& ray, float value, float count) {
    if (count > 0.0f && (ray.g == 0.0f || value > ray.r)) ray.r = value;
    ray.g += count;
  }
  ESVR_HD static void sumUp(RayState& ray, float sum, float count) { ray.r += sum, ray.g += count; }
  /// Says where the light that is absorbed next ends, which matters in RenderMode::kDepth.
  ESVR_HD void setDistance(RayState& ray, float distance) const {
    if (mode == RenderMode::kDepth && ray.g == 0.0f) ray.r = distance;
  }
  ESVR_HD void absorb(RayState& ray, const PixelColor& light) const {
    if (mode == RenderMode::kComposite) {
      ray.r += ray.transmittance * light.r;
      ray.g += ray.transmittance * light.g;
      ray.b += ray.transmittance * light.b;
    }
    ray.transmittance *= 1.0f - light.alpha;
    if (mode == RenderMode::kDepth && ray.transmittance < kHalf) ray.g = 1.0f;
  }
  /// Adds the segment from the last sample into the empty space behind it.
  template <class ShadeRule>
  ESVR_HD void leave(RayState& ray, const ShadeRule& shades) const {
    if (ray.last == RayState::kNone) return;
    setDistance(ray, ray.r + step);
    absorb(ray, shades.ofLast(table.segments(ray.lastValue, background)));
  }
  /// Adds the light between the last sample and the next one that is not empty space.
  template <class ShadeRule>
  ESVR_HD void addSegments(RayState& ray, float value, const SampleNumber& number,
                           const ShadeRule& shades) const {
    const bool consecutive = ray.last != RayState::kNone && number.index == ray.last + 1;
    if (!consecutive) leave(ray, shades);
    setDistance(ray, number.fromEye * step);
    absorb(ray, shades.ofThis(table.segments(consecutive ? ray.lastValue : background, value)));
  }
  /// Adds the light between a ray's samples and those of the next part. \return false if that part
  /// has no samples, or if the ray has none before and has taken over the part
  ESVR_HD bool connect(RayState& ray, const RayState& behind) const {
    if (behind.last == RayState::kNone) return false;
    if (ray.first == RayState::kNone) {
      ray = behind;
      return false;
    }
    addSegments(ray, behind.firstValue, {0.0f, behind.first}, NoShades{});
    ray.last = behind.last, ray.lastValue = behind.lastValue;
    return true;
  }
};

/// The sampling that the tables of a picture are made for. In kMaximum and kAverage one value stands
/// for the whole ray, and has the opacity of the transfer function.
/// \param times  length of a step in units of options.step
[[nodiscard]] inline Sampling samplingOf(const RenderOptions& options, double times = 1.0) {
  const bool alongRay =
      options.mode == RenderMode::kComposite || options.mode == RenderMode::kDepth;
  if (!alongRay) return {1.0, false};
  return {options.step * times / options.opacityLength,
          options.classification == Classification::kPreIntegrated};
}

[[nodiscard]] inline SampleRule sampleRule(const RenderOptions& o, const TransferTableView& table,
                                           float background) {
  return {table, o.mode, o.classification, background, float(o.minTransmittance), float(o.step)};
}

}  // namespace esvr
