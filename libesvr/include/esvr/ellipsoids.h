#pragma once
/// Ellipsoids as a structure of arrays: what a fit yields, a file stores and a renderer draws.

#include <array>
#include <cstddef>
#include <vector>

#include "esvr/coord.h"
#include "esvr/kernel.h"

namespace esvr {

/// n ellipsoids. Ellipsoid i adds intensity[i] * phi(m) to the field, where
/// m = | S^-1 R^T (x - center) |^2, S = diag(exp(logScale)), R the rotation's matrix
/// (paper, section 3.1; phi is in kernel.h). Sigma = R S^2 R^T is never formed.
struct Ellipsoids {
  std::array<std::vector<float>, 3> center;  ///< x, y, z in voxels relative to the chunk's origin
  std::array<std::vector<float>, 3>
      logScale;  ///< natural logarithm of the semi-axes' scale, voxels
  std::array<std::vector<float>, 4> rotation;  ///< unit quaternion w, x, y, z
  std::vector<float> intensity;                ///< value units of the grid, sign free
  std::vector<float> kappa;  ///< edge of each ellipsoid; empty where one serves all

  [[nodiscard]] std::size_t size() const { return intensity.size(); }
  void resize(std::size_t n, bool perEllipsoidKappa = false);
  friend bool operator==(const Ellipsoids&, const Ellipsoids&) = default;
};

/// The largest magnitude of a logScale that files hold. A scale of e^32 voxels is larger than the
/// index space; products of three such scales are far from the ends of float64.
inline constexpr float kMaxLogScale = 32.0f;

/// Throws std::logic_error where the arrays differ in length.
void checkInvariants(const Ellipsoids& e);

/// True where every parameter is finite and every quaternion has unit length to 1e-5.
[[nodiscard]] bool wellFormed(const Ellipsoids& e);

/// Ellipsoids whose centers are relative to one integer origin. A grid no wider than
/// kChunkExtent has one chunk; float32 centers are then exact to 2^-12 voxel.
struct Chunk {
  Coord origin;  ///< index coordinates that (0,0,0) of the centers stands for: a voxel's center
  Ellipsoids ellipsoids;
};
inline constexpr std::int32_t kChunkExtent = 4096;

/// The sum: V(x) = background + sum over chunks and ellipsoids. Voxel (i,j,k) is sampled at x =
/// (i,j,k).
struct Field {
  float background = 0.0f;
  Kernel kernel;  ///< the scene's kernel; its kappa where `Ellipsoids::kappa` is empty
  std::vector<Chunk> chunks;

  [[nodiscard]] std::size_t ellipsoidCount() const;
};

}  // namespace esvr
