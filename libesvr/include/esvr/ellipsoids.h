#pragma once
/// Ellipsoids as a structure of arrays, the form in which a fit returns them, a file stores them
/// and a renderer draws them.

#include <array>
#include <cstddef>
#include <vector>

#include "esvr/coord.h"
#include "esvr/kernel.h"

namespace esvr {

/// n ellipsoids. Ellipsoid i adds intensity[i] * phi(m) to the field, where
/// m = | S^-1 R^T (x - center) |^2, S = diag(exp(logScale)) and R is the rotation's matrix (paper,
/// section 3.1; phi is in kernel.h). Sigma = R S^2 R^T is never formed.
struct Ellipsoids {
  std::array<std::vector<float>, 3> center;  ///< x, y, z in voxels, relative to the chunk's origin
  std::array<std::vector<float>, 3> logScale;  ///< natural logarithms of the scales in voxels
  std::array<std::vector<float>, 4> rotation;  ///< unit quaternion w, x, y, z
  std::vector<float> intensity;                ///< value units of the grid, of either sign
  std::vector<float> kappa;  ///< edge of each ellipsoid; empty if all share the kernel's

  [[nodiscard]] std::size_t size() const { return intensity.size(); }
  void resize(std::size_t n, bool perEllipsoidKappa = false);
  friend bool operator==(const Ellipsoids&, const Ellipsoids&) = default;
};

/// The largest magnitude of a logScale that files hold. A scale of e^32 voxels is larger than the
/// index space; products of three such scales are far from the ends of float64.
inline constexpr float kMaxLogScale = 32.0f;

/// \throws std::logic_error  the arrays differ in length
void checkInvariants(const Ellipsoids& e);

/// True if every parameter is finite and every quaternion has unit length to within 1e-5.
[[nodiscard]] bool wellFormed(const Ellipsoids& e);

/// Ellipsoids whose centers are relative to one integer origin. A grid that is at most
/// kChunkExtent voxels wide has one chunk; float32 centers are then exact to 2^-12 voxel.
struct Chunk {
  Coord origin;  ///< index coordinates of the voxel at (0, 0, 0) in the centers' coordinates
  Ellipsoids ellipsoids;
};
inline constexpr std::int32_t kChunkExtent = 4096;

/// A sum of ellipsoids: V(x) = background + sum over chunks and ellipsoids. Voxel (i, j, k) is
/// sampled at x = (i, j, k).
struct Field {
  float background = 0.0f;
  Kernel kernel;  ///< kernel of all ellipsoids; kernel.kappa is used if Ellipsoids::kappa is empty
  std::vector<Chunk> chunks;

  [[nodiscard]] std::size_t ellipsoidCount() const;
};

}  // namespace esvr
