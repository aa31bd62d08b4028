#pragma once
/// Draws pictures in float64 by the definition in render.h: every ellipsoid at every sample, finer
/// integrals of the transfer function than the library's, no bounds, and no early end of a ray.

#include <functional>

#include "esvr/render.h"

namespace esvr::test {

/// The value at a position. Only values that are exactly the background count as empty.
using ValueAtPlace = std::function<double(const Vec3&)>;

struct SampledScene {
  ValueAtPlace value;
  double background = 0.0;
  double farthest = 0.0;  ///< distance of the last sample
};

[[nodiscard]] ValueAtPlace sumOfEllipsoids(const Field& field);
[[nodiscard]] Image referencePicture(const SampledScene& scene, const RenderOptions& options);

/// The PSNR over all four channels with a peak of 1.
[[nodiscard]] double imagePsnr(const Image& a, const Image& b);
[[nodiscard]] double largestDifference(const Image& a, const Image& b);

}  // namespace esvr::test
