#pragma once
/// The samples of a ray, and the rule that lights them and combines them into a pixel. Nothing here
/// depends on how voxels are stored. The code is compiled for host and device.

#include <cstdint>

#include "esvr/render.h"
#include "render/transfer_table.h"
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

// Shading by the gradient of the values, with one distant light: the model of Blinn and Phong, in
// which surfaces are lit from both sides.

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
  /// Whether voxels are no cubes. The rows of `toCamera` then convert gradients from the index
  /// space to the camera's space.
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
  float low, high;
};
/// \param at    coordinate relative to the brick, from 0 to `side`
ESVR_HD inline DifferenceRange differenceRange(float at, float side) {
  constexpr float kHalf = 0.5f;
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

// The rule that combines samples.

/// The parts of a segment that is divided (SampleRule::bends). They are so short that a jump of the
/// values within a part is drawn as if it lay in the middle of the part, and few enough that
/// surfaces, where segments are divided, cost little.
inline constexpr int kSegmentParts = 4;

/// A sample's place in the sequence of a ray's samples.
struct SampleNumber {
  float fromEye;  ///< number of the sample, counted from the eye
  /// The same, counted from any sample of the ray and modulo 2^32. Unlike the float, it tells
  /// whether two samples are consecutive however far away the eye is.
  std::uint32_t index;
  std::uint32_t apart = 1;  ///< what is subtracted from `index` to get that of the sample before
  float length = 1.0f;      ///< of the segment between the two, in steps
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

/// How a ray with divided segments goes on. Marches count parts of segments: sample i is number
/// (i + 1) kSegmentParts, so that the parts of the segment before the first sample have numbers,
/// too.
struct RayParts {
  float change = 0.0f;   ///< of the value over a step, before the last sample that was added
  bool divided = false;  ///< true while the parts of a divided segment are added

  /// Parts from the last sample that was added to the next.
  [[nodiscard]] ESVR_HD int apart() const { return divided ? 1 : kSegmentParts; }
  /// Begins to divide the segment before a sample. \return its first part
  ESVR_HD int divide(int part) {
    divided = true;
    return part - kSegmentParts + 1;
  }
  /// Goes on to the next sample or part.
  ESVR_HD int next(int part) {
    if (part % kSegmentParts == 0) divided = false;
    return part + apart();
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

  /// Adds a sample of empty space, which ends the segment from the sample before it. Samples that
  /// follow one of empty space may be left out if they are empty, too.
  template <class ShadeRule = NoShades>
  ESVR_HD void addEmpty(RayState& ray, const ShadeRule& shades = {}, float length = 1.0f) const {
    leave(ray, shades, length);
    ray.last = RayState::kNone;
  }

  /// The value of the sample before one that is to be added.
  [[nodiscard]] ESVR_HD float valueBefore(const RayState& ray, const SampleNumber& number) const {
    return follows(ray, number) ? ray.lastValue : background;
  }

  /// Whether the segment before a sample must be divided into kSegmentParts, because its values are
  /// not linear. They are not where a ray meets a jump, such as a face of a constant body: drawn as
  /// linear, the face would have stripes that show the places of the samples, and silhouettes would
  /// be frayed.
  [[nodiscard]] ESVR_HD bool bends(const RayState& ray, const RayParts& parts,
                                   const SampleNumber& number, float value) const {
    if (parts.divided || classification != Classification::kPreIntegrated ||
        mode == RenderMode::kMaximum || mode == RenderMode::kAverage)
      return false;
    if (follows(ray, number))
      return table.segments.bends(ray.lastValue, value, parts.change, ray.transmittance);
    return value != background && table.segments.bends(background, value, 0.0f, ray.transmittance);
  }

  /// Goes on to samples that follow another rule, for example in another level of detail. Their
  /// first one is the sample that this rule has reached.
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
  /// Whether a sample's segment begins at the last sample that was added.
  ESVR_HD static bool follows(const RayState& ray, const SampleNumber& number) {
    return ray.last != RayState::kNone && number.index == ray.last + number.apart;
  }
  /// Adds the segment from the last sample into the empty space behind it.
  template <class ShadeRule>
  ESVR_HD void leave(RayState& ray, const ShadeRule& shades, float length = 1.0f) const {
    if (ray.last == RayState::kNone) return;
    setDistance(ray, ray.r + step * length);
    absorb(ray, shades.ofLast(table.segments(ray.lastValue, background, length)));
  }
  /// Adds the light between the last sample and the next one that is not empty space.
  template <class ShadeRule>
  ESVR_HD void addSegments(RayState& ray, float value, const SampleNumber& number,
                           const ShadeRule& shades) const {
    const float before = valueBefore(ray, number);
    if (!follows(ray, number)) leave(ray, shades);
    setDistance(ray, number.fromEye * step);
    absorb(ray, shades.ofThis(table.segments(before, value, number.length)));
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

/// The sampling that the tables of a picture are made for. In kMaximum and kAverage one value
/// stands for the whole ray, and has the opacity of the transfer function.
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

// The samples of a march through voxels.

/// What all rays of a march share.
struct MarchScene {
  View view;
  PlaceBox box;  ///< every sample outside this box is the background
  double step;
  ClipBox clip;
  SampleRule rule;
  bool isShaded = false;
  LightRule light{};  ///< used if isShaded
};

/// The samples of a ray inside the box, of which `begin` to `end` - 1 are wanted. Sample i lies at
/// first + i apart. It is computed from the first sample in the box and not from the eye, so that
/// float32 is precise enough, and not from the first one that is wanted, so that it does not depend
/// on what is wanted. Parts of segments are counted as RayParts does.
struct MarchSamples {
  FloatPlace first, apart;
  FloatPlace perVoxel;  ///< samples in a step of a voxel along each axis; 0 where they do not move
  float number;         ///< number of sample 0, counted from the camera's eye
  int begin, end;
  /// The last part to visit. Where the ray leaves the box or the clip box, it is that of the first
  /// sample behind, which is empty and ends the last segment.
  int lastPart;
  int firstInside, lastInside;  ///< parts between the ends of the ray's way through both boxes

  [[nodiscard]] ESVR_HD int firstPart() const { return (begin + 1) * kSegmentParts; }
  /// Begins a ray. Where it passes a clip box between two samples, it begins within a segment.
  /// \return the first part to visit
  [[nodiscard]] ESVR_HD int start(RayParts& parts) const {
    return begin < end || lastPart == 0 ? firstPart() : parts.divide(firstPart());
  }
  /// False: the part is empty space, whatever the voxels there are.
  [[nodiscard]] ESVR_HD bool inside(int part) const {
    return part >= firstInside && part <= lastInside;
  }
  [[nodiscard]] ESVR_HD FloatPlace at(int part) const {
    const float n = sampleOf(part);
    return {first.x + n * apart.x, first.y + n * apart.y, first.z + n * apart.z};
  }
  /// \param from  parts from the sample or part before
  [[nodiscard]] ESVR_HD SampleNumber numberOf(int part, int from) const {
    constexpr float kLength = 1.0f / float(kSegmentParts);
    return {number + sampleOf(part), std::uint32_t(part), std::uint32_t(from),
            float(from) * kLength};
  }

 private:
  /// Exact for whole samples.
  ESVR_HD static float sampleOf(int part) {
    return float(part - kSegmentParts) * (1.0f / float(kSegmentParts));
  }
};

ESVR_HD inline float samplesPerVoxel(float apart) {
  constexpr float kStill = 1e-30f;  // so slow that no ray is long enough to leave a brick
  return std::fabs(apart) < kStill ? 0.0f : 1.0f / apart;
}

/// The part of a ray in the box and in the clip box.
ESVR_HD inline RayInterval withinScene(const MarchScene& s, const Ray& ray) {
  const RayInterval box = within(ray, s.box);
  if (!s.clip.given) return box;
  const RayInterval clip = within(ray, s.clip.box);
  return {greater(box.begin, clip.begin), lesser(box.end, clip.end)};
}
/// The samples of a ray in the box and in the clip box.
ESVR_HD inline SampleRange samplesInScene(const MarchScene& s, const Ray& ray) {
  return samplesIn(withinScene(s, ray), s.step);
}
struct PartRange {
  int first, last;
};
/// The parts of a ray's segments in an interval, counted from a sample as RayParts does.
/// \param first  number of the sample, counted from the ray's origin
ESVR_HD inline PartRange partsIn(const RayInterval& t, double step, double first) {
  constexpr double kMost = double(kMostRaySamples + 1) * kSegmentParts;
  const auto part = [&](double distance) {
    return clampedTo((distance / step - first + 1.0) * kSegmentParts, 0.0, kMost);
  };
  return {int(std::ceil(part(t.begin))), int(std::floor(part(t.end)))};
}

/// Whether a ray passes the clip box between two of its samples. Elsewhere, such rays are left out:
/// the values at the faces of the box of all cells are the background.
/// \param t, range  its part in both boxes, and the samples there
ESVR_HD inline bool passesBetween(const MarchScene& s, const RayInterval& t,
                                  const SampleRange& range, const SampleRange& wanted) {
  return s.clip.given && t.begin < t.end && range.last < range.first && wanted.has(range.first);
}

/// The samples of the ray of a pixel. \param wanted  further limit on their range
ESVR_HD inline MarchSamples samplesOf(const MarchScene& s, int column, int row,
                                      const SampleRange& wanted) {
  const Ray ray = s.view.ray(column, row);
  const RayInterval t = withinScene(s, ray);
  const SampleRange range = samplesIn(t, s.step), both = range.both(wanted);
  const bool isBetween = passesBetween(s, t, range, wanted);
  if (!(both.first <= both.last) && !isBetween)
    return {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, 0.0f, 0, 0, 0, 0, 0};
  const FloatPlace apart = floatPlace(scaled(ray.direction, s.step));
  const PartRange inside = partsIn(t, s.step, range.first);
  const int end = isBetween ? 0 : range.countTo(both.last) + 1;
  return {floatPlace(sum(ray.origin, scaled(ray.direction, range.first * s.step))),
          apart,
          {samplesPerVoxel(apart.x), samplesPerVoxel(apart.y), samplesPerVoxel(apart.z)},
          float(range.first + s.view.before / s.step),
          isBetween ? 0 : range.countTo(both.first),
          end,
          (range.last < wanted.last ? end + 1 : end) * kSegmentParts,
          inside.first,
          inside.last};
}

ESVR_HD inline float samplesToFace(float place, float perVoxel, int low, int high) {
  if (perVoxel == 0.0f) return 1e30f;
  return ((perVoxel > 0.0f ? float(high) : float(low)) - place) * perVoxel;
}

/// Number of samples from a place to the first one outside an empty cube, at least 1.
/// \param low, side  lowest corner and side of the cube
ESVR_HD inline int samplesToLeave(const FloatPlace& p, const FloatPlace& perVoxel, const Coord& low,
                                  int side) {
  constexpr float kRounding = 1e-3f;
  const float x = samplesToFace(p.x, perVoxel.x, low.x, low.x + side);
  const float y = samplesToFace(p.y, perVoxel.y, low.y, low.y + side);
  const float z = samplesToFace(p.z, perVoxel.z, low.z, low.z + side);
  const float leave = x < y ? (x < z ? x : z) : (y < z ? y : z);
  const float whole = std::ceil(leave - kRounding);
  return whole > 1.0f ? (whole < 1e9f ? int(whole) : 1000000000) : 1;
}

}  // namespace esvr
