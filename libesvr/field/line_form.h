#pragma once
/// An ellipsoid prepared for evaluation along lines parallel to y.
///
/// With L = S^-1 R^T (or any Q L, Q a rotation) and d = x - mu, m = |L d|^2. Along the line
/// d = (dx, t + y*, dz) with y* = sx dx + sz dz the place of closest approach,
///
///     m = |px dx + pz dz|^2 + a t^2,   a = |Ly|^2,  px = Lx - Ly (Lx.Ly) / a,  pz likewise,
///
/// a sum of two non-negative terms: nothing cancels, so float32 holds for needles and pancakes too,
/// and a row of eight voxels costs one multiply-add each. The coefficients are computed in float64.

#include <array>
#include <cstddef>

#include "esvr/ellipsoids.h"

namespace esvr {

/// Row-major 3x3: rows are L's rows, so that u = L d.
using Matrix3 = std::array<double, 9>;

struct LineForm {
  std::array<float, 3> center;  ///< voxels, relative to whatever frame the caller works in
  std::array<float, 3> px, pz;  ///< columns of L along x and z, projected off Ly
  std::array<float, 3> ly;      ///< column of L along y
  float sx, sz;                 ///< shift of the closest approach
  float a;                      ///< |Ly|^2
  float halfX;                  ///< half width of the support's bounding box along x
  float slopeYx, halfYx;  ///< in the plane dx: y-extent slopeYx dx +- halfYx sqrt(1 - (dx/halfX)^2)
  float intensity;
};

/// \param L       maps displacements to the unit frame
/// \param radius  of the support in the unit frame (supportRadius)
[[nodiscard]] LineForm makeLineForm(const std::array<double, 3>& center, const Matrix3& L,
                                    double radius, double intensity);

/// L = S^-1 R^T of ellipsoid i.
[[nodiscard]] Matrix3 unitFrame(const Ellipsoids& e, std::size_t i);

/// F = L^-1: its columns are the semi-axes' directions times their scales, up to a rotation.
[[nodiscard]] Matrix3 inverse(const Matrix3& L);

}  // namespace esvr
