#pragma once
/// The form of an ellipsoid during a fit.
///
/// Its shape is L, any matrix with Sigma^-1 = L^T L. Steps are taken in the unit frame of the
/// ellipsoid: mu += F delta with F = L^-1, and L <- exp(-A) L with A symmetric. A step of a given
/// size thus changes any ellipsoid by the same fraction of itself. Spheres, where a rotation has no
/// gradient, need no special treatment.

#include <array>
#include <cstddef>
#include <vector>

#include "field/line_form.h"

namespace esvr {

struct Ellipsoid {
  std::array<double, 3> center;  ///< voxels relative to the volume's origin
  Matrix3 L;
  double intensity;  ///< units of the target (FitTarget::scale)
};

/// A gradient or a step in an ellipsoid's own frame. The order is delta (3), A as xx yy zz xy xz yz
/// (6), intensity (1).
inline constexpr int kParameters = 10;
using ParameterVector = std::array<double, kParameters>;

/// Principal axes of L: the scales and the rotation with L = Q S^-1 R^T, as Ellipsoids store them.
struct PrincipalAxes {
  std::array<double, 3> scale;     ///< decreasing
  std::array<double, 4> rotation;  ///< unit quaternion w, x, y, z, w >= 0
};
[[nodiscard]] PrincipalAxes principalAxes(const Matrix3& L);

}  // namespace esvr
