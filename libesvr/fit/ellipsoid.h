#pragma once
/// An ellipsoid while it is being fitted.
///
/// The shape is kept as L, any matrix with Sigma^-1 = L^T L, and moves in the
/// unit frame of the ellipsoid itself: mu += F delta, L <- exp(-A) L with A symmetric, F = L^-1. A
/// step of a given size changes any ellipsoid by the same fraction of itself, and spheres, where a
/// rotation has no gradient and no meaning, are no special case.

#include <array>
#include <cstddef>
#include <vector>

#include "field/line_form.h"

namespace esvr {

struct Ellipsoid {
  std::array<double, 3> center;  ///< voxels relative to the volume's origin
  Matrix3 L;
  double intensity;  ///< in units of FitTarget::scale
};

/// Gradient of the loss in an ellipsoid's own frame, or a step along it.
/// Order: delta (3), A as xx yy zz xy xz yz (6), intensity (1).
inline constexpr int kParameters = 10;
using ParameterVector = std::array<double, kParameters>;

/// Principal axes of L: scales and a rotation with L = Q S^-1 R^T, as Ellipsoids store them.
struct PrincipalAxes {
  std::array<double, 3> scale;     ///< decreasing
  std::array<double, 4> rotation;  ///< unit quaternion w, x, y, z, w >= 0
};
[[nodiscard]] PrincipalAxes principalAxes(const Matrix3& L);

}  // namespace esvr
