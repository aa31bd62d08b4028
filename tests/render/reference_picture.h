#pragma once
/// Pictures and the light of rays in float64 by the definitions in render.h and docs/math.md: every
/// ellipsoid at every sample, finer integrals of the transfer function than the library's, no
/// bounds, and no early end of a ray.

#include <array>
#include <functional>
#include <vector>

#include "esvr/render.h"
#include "esvr/volume.h"

namespace esvr::test {

/// Red, green and blue, each times the extinction, and the extinction.
using Channels = std::array<double, 4>;

[[nodiscard]] Channels channelsAt(const TransferFunction& function, double value, double length);

/// The integrals of a transfer function over the value, at 16 times the places of the library.
class Integrals {
 public:
  /// \param length  length of a step, in units of the length that opacities are given for
  Integrals(const TransferFunction& function, double length);

  [[nodiscard]] Channels meanBetween(double a, double b) const;
  [[nodiscard]] Channels at(double value) const { return channelsAt(function_, value, length_); }
  /// Whether a segment whose values bend has light that depends on it (docs/math.md).
  [[nodiscard]] bool bends(double a, double b, double changeBefore, double weight) const;

 private:
  [[nodiscard]] double placeOf(double value) const;
  [[nodiscard]] double upTo(double place, std::size_t channel) const;

  TransferFunction function_;
  double length_, low_, scale_;
  std::vector<Channels> means_;   ///< of the values below, of each interval, and of those above
  std::vector<Channels> before_;  ///< integrals up to each interval
  double mostExtinction_ = 0.0;
};

/// Premultiplied color, and what is left of the light behind.
struct Light {
  double r = 0.0, g = 0.0, b = 0.0, transmittance = 1.0;
};

/// The light of a ray.
class LightOnRay {
 public:
  LightOnRay(const Integrals& integrals, double background, Classification classification)
      : integrals_(integrals),
        background_(background),
        last_(background),
        classification_(classification) {}

  /// Adds the next sample. Values that are exactly the background are empty space.
  /// \param length  of the segment before it, in steps
  void add(double value, double length = 1.0);
  /// Whether the segment before a sample must be divided (docs/math.md).
  [[nodiscard]] bool bends(double value) const;
  [[nodiscard]] const Light& light() const { return light_; }

 private:
  void addSegment(double a, double b, double length);
  void absorb(const Channels& mean, double length);

  const Integrals& integrals_;
  double background_, last_, change_ = 0.0;
  Classification classification_;
  Light light_;
};

/// The value at a position. Only values that are exactly the background count as empty.
using ValueAtPlace = std::function<double(const Vec3&)>;

struct SampledScene {
  ValueAtPlace value;
  double background = 0.0;
  double farthest = 0.0;  ///< distance of the last sample
  bool divides = true;    ///< false for the sum of ellipsoids, whose segments are not divided
};

[[nodiscard]] ValueAtPlace sumOfEllipsoids(const Field& field);
/// Trilinear interpolation.
[[nodiscard]] double trilinear(const SparseVolume& volume, const Vec3& place);
[[nodiscard]] Image referencePicture(const SampledScene& scene, const RenderOptions& options);

/// The PSNR over all four channels with a peak of 1.
[[nodiscard]] double imagePsnr(const Image& a, const Image& b);
/// The largest difference of a channel; 1 if the pictures differ in size.
[[nodiscard]] double largestDifference(const Image& a, const Image& b);
/// Expects that a picture shows anything, because an empty one proves nothing.
void expectAnyLight(const Image& image);
void expectTransparent(const Image& image);
/// Expects channels to agree to within 1/255, but for one in `many`: rounding decides about the few
/// voxels whose value is at the threshold.
void expectClose(const Image& image, const Image& expected, std::size_t many = 1000);

}  // namespace esvr::test
