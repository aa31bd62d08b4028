#pragma once
/// Shading by the gradient of the values, with one distant light: the model of Blinn and Phong, in
/// which surfaces are lit from both sides. The code is compiled for host and device.

#include "esvr/render.h"
#include "render/segment_table.h"
#include "render/vector.h"
#include "render/view.h"

namespace esvr {

struct FloatPlace {
  float x, y, z;
};

ESVR_HD inline FloatPlace floatPlace(const Vec3& v) {
  return {float(v[0]), float(v[1]), float(v[2])};
}
ESVR_HD inline float inner(const FloatPlace& a, const FloatPlace& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

/// What the light makes of a color at a place.
struct Shade {
  float color = 1.0f;  ///< factor of the color
  float white = 0.0f;  ///< highlight, which is added for an opacity of 1

  [[nodiscard]] ESVR_HD PixelColor lit(const PixelColor& c) const {
    const float highlight = white * c.alpha;
    return {c.r * color + highlight, c.g * color + highlight, c.b * color + highlight, c.alpha};
  }
};

struct LightRule {
  FloatPlace toLight;  ///< of unit length
  float ambient, diffuse, specular, shininess;
  float weakSquared;  ///< square of a gradient that has half of its effect
  /// Whether voxels are no cubes. The rows of `toCamera` then convert gradients from the index space to
  /// the camera's space.
  bool converts = false;
  FloatPlace toCamera[3] = {};

  /// \param inIndex    gradient of the values in index space; a place without one is lit from the front
  /// \param direction  of the ray in the camera's space, of unit length
  [[nodiscard]] ESVR_HD Shade shadeOf(const FloatPlace& inIndex,
                                      const FloatPlace& direction) const {
    const FloatPlace gradient =
        converts ? FloatPlace{inner(toCamera[0], inIndex), inner(toCamera[1], inIndex),
                              inner(toCamera[2], inIndex)}
                 : inIndex;
    const float squared = inner(gradient, gradient);
    if (!(squared > 0.0f)) return {ambient + diffuse, 0.0f};
    const float perLength = 1.0f / std::sqrt(squared);
    const FloatPlace half{toLight.x - direction.x, toLight.y - direction.y,
                          toLight.z - direction.z};
    const float facing = std::fabs(inner(gradient, toLight)) * perLength;
    const float mirrored = std::fabs(inner(gradient, half)) * perLength / lengthOf(half);
    const float strength = squared / (squared + weakSquared);
    return {ambient + diffuse * (1.0f + strength * (facing - 1.0f)),
            strength * specular * std::pow(mirrored, shininess)};
  }

 private:
  /// The length, or a small number for a light behind the volume, which has no highlights.
  ESVR_HD static float lengthOf(const FloatPlace& v) {
    constexpr float kShort = 1e-6f;
    const float length = std::sqrt(inner(v, v));
    return length > kShort ? length : kShort;
  }
};

/// \throws UsageError  the direction has no length, or a factor is negative or not finite
[[nodiscard]] LightRule lightRule(const Shading& shading, const View& view,
                                  const TransferFunction& transfer);

/// A rule that leaves colors as they are; see SampleRule::add().
struct NoShades {
  [[nodiscard]] ESVR_HD PixelColor ofLast(const PixelColor& c) const { return c; }
  [[nodiscard]] ESVR_HD PixelColor ofThis(const PixelColor& c) const { return c; }
};
/// The shades at the last sample that was added to a ray and at the one that is added now.
struct Shades {
  Shade last, now;
  [[nodiscard]] ESVR_HD PixelColor ofLast(const PixelColor& c) const { return last.lit(c); }
  [[nodiscard]] ESVR_HD PixelColor ofThis(const PixelColor& c) const { return now.lit(c); }
};

/// The range of coordinates between which a derivative is taken: half a voxel to each side, but not
/// beyond the brick, so that the voxels of one brick suffice.
struct DifferenceRange {
  static constexpr float kHalf = 0.5f;
  float low, high;
};
/// \param at    coordinate relative to the brick, from 0 to `side`
ESVR_HD inline DifferenceRange differenceRange(float at, float side) {
  constexpr float kHalf = DifferenceRange::kHalf;
  return {at > kHalf ? at - kHalf : 0.0f, at < side - kHalf ? at + kHalf : side};
}

/// The gradient of interpolated values. \param valueAt  value at a place relative to the brick
/// \param p  place relative to a brick of `side` voxels
template <class ValueAt>
ESVR_HD inline FloatPlace gradientAt(const FloatPlace& p, float side, ValueAt&& valueAt) {
  const DifferenceRange x = differenceRange(p.x, side), y = differenceRange(p.y, side),
                        z = differenceRange(p.z, side);
  return {(valueAt(FloatPlace{x.high, p.y, p.z}) - valueAt(FloatPlace{x.low, p.y, p.z})) /
              (x.high - x.low),
          (valueAt(FloatPlace{p.x, y.high, p.z}) - valueAt(FloatPlace{p.x, y.low, p.z})) /
              (y.high - y.low),
          (valueAt(FloatPlace{p.x, p.y, z.high}) - valueAt(FloatPlace{p.x, p.y, z.low})) /
              (z.high - z.low)};
}

}  // namespace esvr
