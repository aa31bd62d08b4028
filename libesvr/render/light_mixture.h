#pragma once
/// The light of several grids within one segment of a ray (docs/math.md, "Several grids"). The code is
/// compiled for host and device.

#include "render/segment_table.h"

namespace esvr {

/// Adds up the extinctions and the emissions of grids that share a segment.
class LightMixture {
 public:
  /// \param light  of a grid by itself
  ESVR_HD void add(const PixelColor& light, bool absorbs) {
    if (!(light.alpha > 0.0f)) return;
    const float own = depthOf(light.alpha), perAlpha = own / light.alpha;
    r_ += light.r * perAlpha, g_ += light.g * perAlpha, b_ += light.b * perAlpha;
    if (absorbs) depth_ += own;
  }
  /// The light of all grids, with the opacity of those that absorb.
  [[nodiscard]] ESVR_HD PixelColor total() const {
    const float alpha = -std::expm1(-depth_), share = depth_ > 0.0f ? alpha / depth_ : 1.0f;
    return {r_ * share, g_ * share, b_ * share, alpha};
  }

 private:
  /// The optical depth of an opacity. An opacity of 1 has the depth of the next smaller float.
  ESVR_HD static float depthOf(float alpha) {
    constexpr float kMost = 1.0f - 0x1p-24f;
    return -std::log1p(-(alpha < kMost ? alpha : kMost));
  }

  float r_ = 0.0f, g_ = 0.0f, b_ = 0.0f;  ///< emission: color times optical depth
  float depth_ = 0.0f;
};

}  // namespace esvr
