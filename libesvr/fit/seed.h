#pragma once
/// New ellipsoids at voxels of large error: the random numbers by which voxels are drawn, and the
/// seed that follows from the residual around a voxel. The arithmetic is for host and device.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

#include "esvr/ellipsoids.h"
#include "esvr/volume.h"
#include "fit/ellipsoid.h"

namespace esvr {

/// The allowed signs of a seed's intensity. A positive intensity reduces the error where V is too
/// low.
struct SignsAllowed {
  bool positive = true, negative = false;
  [[nodiscard]] ESVR_HD bool mends(float residual) const {
    return residual < 0.0f ? positive : negative;
  }
};

/// The squared residual if a seed of an allowed sign can reduce it, else 0.
ESVR_HD inline double sampleEnergy(float residual, SignsAllowed signs) {
  return signs.mends(residual) ? double(residual) * double(residual) : 0.0;
}

/// A uniform random number in [0, 1) for draw `n` of a random seed.
ESVR_HD inline double sampleUniform(std::uint64_t seed, std::uint64_t n) {
  std::uint64_t z =
      seed * 0x9e3779b97f4a7c15ull + n * 0xbf58476d1ce4e5b9ull + 0x94d049bb133111ebull;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
  return double((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

struct SamplingOptions {
  std::size_t count = 0;
  std::size_t targetBricks = 0;  ///< number of bricks, the first of the residual, that are sampled
  SignsAllowed signs{};
  std::uint64_t seed = 1;
};

/// Moments about a voxel of the residual of one sign.
struct SeedMoments {
  double mass = 0.0;
  double energy = 0.0;  ///< sum of squares
  double x = 0.0, y = 0.0, z = 0.0;
  double xx = 0.0, yy = 0.0, zz = 0.0, xy = 0.0, xz = 0.0, yz = 0.0;

  /// \param d  offset from the voxel
  /// \param r  magnitude of the residual at this offset
  ESVR_HD void add(Coord d, double r) {
    mass += r;
    energy += r * r;
    x += r * d.x, y += r * d.y, z += r * d.z;
    xx += r * d.x * d.x, yy += r * d.y * d.y, zz += r * d.z * d.z;
    xy += r * d.x * d.y, xz += r * d.x * d.z, yz += r * d.y * d.z;
  }
};

/// The window is a ball of radius w. The + 1 makes its poles wider than one voxel.
ESVR_HD inline bool inSeedWindow(Coord d, int w) {
  return d.x * d.x + d.y * d.y + d.z * d.z <= w * w + 1;
}

struct SeedShape {
  double unitVariance;  ///< KernelMoments::variance
  double intensity;     ///< intensity of a seed, relative to the residual
  double share;         ///< energy for each draw
};

/// The intensity of a seed at a voxel with the residual r. If several draws fall into the window,
/// they share the residual.
ESVR_HD inline double seedHeight(double r, const SeedMoments& m, const SeedShape& shape) {
  const double drawsInWindow = m.energy / shape.share;
  return -r * shape.intensity / (drawsInWindow > 1.0 ? drawsInWindow : 1.0);
}

/// A seed with the mean and the covariance of the moments. \param r  residual at the voxel
ESVR_HD inline Ellipsoid seedFromMoments(Coord voxel, double r, const SeedMoments& m,
                                         const SeedShape& shape) {
  constexpr double kSmallestVariance = 0.25;  // voxels^2, for seeds on a single voxel
  const Eigen::Vector3d mean(m.x / m.mass, m.y / m.mass, m.z / m.mass);
  Eigen::Matrix3d covariance;
  covariance(0, 0) = m.xx / m.mass - mean[0] * mean[0];
  covariance(1, 1) = m.yy / m.mass - mean[1] * mean[1];
  covariance(2, 2) = m.zz / m.mass - mean[2] * mean[2];
  covariance(0, 1) = covariance(1, 0) = m.xy / m.mass - mean[0] * mean[1];
  covariance(0, 2) = covariance(2, 0) = m.xz / m.mass - mean[0] * mean[2];
  covariance(1, 2) = covariance(2, 1) = m.yz / m.mass - mean[1] * mean[2];
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes;
  axes.computeDirect(covariance);

  Ellipsoid p;
  p.center = {voxel.x + mean[0], voxel.y + mean[1], voxel.z + mean[2]};
  for (int i = 0; i < 3; ++i) {
    const double variance = axes.eigenvalues()[i];
    const double kept = variance > kSmallestVariance ? variance : kSmallestVariance;
    const double inverseScale = std::sqrt(shape.unitVariance / kept);
    for (int j = 0; j < 3; ++j) p.L[3 * i + j] = inverseScale * axes.eigenvectors()(j, i);
  }
  p.intensity = seedHeight(r, m, shape);
  return p;
}

/// Moments of phi over the unit frame, in which m is the squared distance from the center.
struct KernelMoments {
  double mass;      ///< integral of phi
  double variance;  ///< along an axis, of the density that is proportional to phi
};

[[nodiscard]] inline KernelMoments kernelMoments(const KernelConstants<double>& kernel) {
  constexpr int kSteps = 400;
  const double radius = supportRadius(kernel);
  double mass = 0.0, second = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    const double q = radius * (i + 0.5) / kSteps;
    const double weight = kernelPhi(kernel, q * q) * q * q;
    mass += weight;
    second += weight * q * q / 3.0;
  }
  return {4.0 * std::numbers::pi * radius / kSteps * mass, second / mass};
}

}  // namespace esvr
