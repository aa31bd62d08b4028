#pragma once
/// From the residual around a voxel to an ellipsoid, for host and device.

#include <cmath>

#include "esvr/coord.h"
#include "fit/eigen.h"
#include "fit/ellipsoid.h"

namespace esvr {

/// Moments of the residual of one sign about a voxel.
struct SeedMoments {
  double mass = 0.0;
  double energy = 0.0;  ///< sum of squares
  double x = 0.0, y = 0.0, z = 0.0;
  double xx = 0.0, yy = 0.0, zz = 0.0, xy = 0.0, xz = 0.0, yz = 0.0;

  /// \param d  from the voxel  \param r  magnitude of the residual there
  ESVR_HD void add(Coord d, double r) {
    mass += r;
    energy += r * r;
    x += r * d.x, y += r * d.y, z += r * d.z;
    xx += r * d.x * d.x, yy += r * d.y * d.y, zz += r * d.z * d.z;
    xy += r * d.x * d.y, xz += r * d.x * d.z, yz += r * d.y * d.z;
  }
};

/// The window is a ball of half width w, its poles thickened to more than one voxel.
ESVR_HD inline bool inSeedWindow(Coord d, int w) {
  return d.x * d.x + d.y * d.y + d.z * d.z <= w * w + 1;
}

struct SeedShape {
  double unitVariance;  ///< SeedOptions::unitVariance
  double intensity;     ///< SeedOptions::intensity
  double share;         ///< energy that each draw stands for
};

/// Height of a seed where the residual is r. Where little is left to mend but in a few places, many
/// draws fall close together, and all of them would fill the same gap: they share it.
ESVR_HD inline double seedHeight(double r, const SeedMoments& m, const SeedShape& shape) {
  const double countsAround = m.energy / shape.share;
  return -r * shape.intensity / (countsAround > 1.0 ? countsAround : 1.0);
}

/// An ellipsoid of the moments' place and spread. \param r  the residual at the voxel
ESVR_HD inline Ellipsoid seedFromMoments(Coord voxel, double r, const SeedMoments& m,
                                         const SeedShape& shape) {
  constexpr double kSmallestVariance = 0.25;  // voxels^2: a seed of one voxel still has a shape
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

}  // namespace esvr
