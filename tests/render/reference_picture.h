#pragma once
/// Pictures by the definition in render.h, in float64: every ellipsoid at every sample, the
/// transfer function itself instead of a table of it, no bounds, no end of a ray before its last
/// sample.

#include <functional>

#include "esvr/render.h"

namespace esvr::test {

/// The value at a place; nothing counts as empty but exactly the background.
using ValueAtPlace = std::function<double(const Vec3&)>;

struct SampledScene {
  ValueAtPlace value;
  double background = 0.0;
  double farthest = 0.0;  ///< distance of the last sample
};

[[nodiscard]] ValueAtPlace sumOfEllipsoids(const Field& field);
[[nodiscard]] Image referencePicture(const SampledScene& scene, const RenderOptions& options);

/// Over all four channels, of a peak of 1.
[[nodiscard]] double imagePsnr(const Image& a, const Image& b);
[[nodiscard]] double largestDifference(const Image& a, const Image& b);

}  // namespace esvr::test
