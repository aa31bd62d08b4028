#include "format/chunk_box.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/rotation.h"

namespace esvr::format {
namespace {

using Vec3 = std::array<double, 3>;

std::int32_t clampedFloor(double v) {
  return std::int32_t(std::clamp(std::floor(v), double(Box::kMin), double(Box::kMax)));
}
std::int32_t clampedCeil(double v) {
  return std::int32_t(std::clamp(std::ceil(v), double(Box::kMin), double(Box::kMax)));
}

Vec3 centerOf(const Chunk& chunk, std::size_t i) {
  const auto& c = chunk.ellipsoids.center;
  return {chunk.origin.x + double(c[0][i]), chunk.origin.y + double(c[1][i]),
          chunk.origin.z + double(c[2][i])};
}

/// Grows the box by [center - half, center + half].
void expand(Box& box, const Vec3& center, const Vec3& half) {
  box.expand(Coord{clampedFloor(center[0] - half[0]), clampedFloor(center[1] - half[1]),
                   clampedFloor(center[2] - half[2])});
  box.expand(Coord{clampedCeil(center[0] + half[0]), clampedCeil(center[1] + half[1]),
                   clampedCeil(center[2] + half[2])});
}

/// Half widths of an ellipsoid's bounding box for a support radius of 1: the lengths of the rows of
/// R S.
Vec3 unitHalfWidths(const Ellipsoids& e, std::size_t i) {
  const Matrix3 R =
      rotationOf({e.rotation[0][i], e.rotation[1][i], e.rotation[2][i], e.rotation[3][i]});
  Vec3 half{};
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t j = 0; j < 3; ++j)
      half[a] = std::hypot(half[a], R[3 * a + j] * std::exp(double(e.logScale[j][i])));
    // A scale that overflows gives 0 * inf; the box is then unbounded.
    if (std::isnan(half[a])) half[a] = HUGE_VAL;
  }
  return half;
}

/// The radius of the support; 0 for the paper's kernel at a negative kappa, whose support is empty.
double radiusOf(const Kernel& kernel, double kappa) {
  const double radius = supportRadius(kernelConstants<double>(kernel, kappa));
  return radius > 0.0 ? radius : 0.0;
}

}  // namespace

Box supportBox(const Chunk& chunk, Run run, const Kernel& kernel) {
  const auto& e = chunk.ellipsoids;
  const double sceneRadius = radiusOf(kernel, kernel.kappa);
  Box box;
  for (std::size_t i = run.first; i < run.first + run.count; ++i) {
    const double radius = e.kappa.empty() ? sceneRadius : radiusOf(kernel, e.kappa[i]);
    Vec3 half = unitHalfWidths(e, i);
    for (double& h : half) h = radius > 0.0 ? h * radius : 0.0;
    expand(box, centerOf(chunk, i), half);
  }
  return box;
}

Box centerBox(const Chunk& chunk, Run run) {
  Box box;
  for (std::size_t i = run.first; i < run.first + run.count; ++i)
    expand(box, centerOf(chunk, i), {});
  return box;
}

}  // namespace esvr::format
