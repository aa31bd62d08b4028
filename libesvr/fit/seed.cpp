#include "fit/seed.h"

#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace esvr {
namespace {

constexpr double kSmallestVariance = 0.25;  // voxels^2: a seed of one voxel still has a shape

/// Moments of the residual of one sign in a window.
struct Moments {
  double mass = 0.0;
  Eigen::Vector3d first = Eigen::Vector3d::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
};

Moments momentsAround(const ResidualField& residual, Coord voxel, double sign, int w) {
  Moments m;
  for (int x = -w; x <= w; ++x)
    for (int y = -w; y <= w; ++y)
      for (int z = -w; z <= w; ++z) {
        if (x * x + y * y + z * z > w * w + 1) continue;
        const double r = sign * residual.at(voxel + Coord{x, y, z});
        if (r <= 0.0) continue;
        const Eigen::Vector3d d(x, y, z);
        m.mass += r;
        m.first += r * d;
        m.second += r * d * d.transpose();
      }
  return m;
}

Primitive seedAt(const ResidualField& residual, Coord voxel, const SeedOptions& options) {
  const double r = residual.at(voxel);
  const Moments m = momentsAround(residual, voxel, r < 0.0 ? -1.0 : 1.0, options.window);
  const Eigen::Vector3d mean = m.first / m.mass;
  Eigen::Matrix3d covariance = m.second / m.mass - mean * mean.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(covariance);
  const Eigen::Vector3d scale =
      (axes.eigenvalues().cwiseMax(kSmallestVariance) / options.unitVariance).cwiseSqrt();
  const Eigen::Matrix3d L = scale.cwiseInverse().asDiagonal() * axes.eigenvectors().transpose();

  Primitive p;
  p.center = {voxel.x + mean[0], voxel.y + mean[1], voxel.z + mean[2]};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) p.L[3 * i + j] = L(i, j);
  p.intensity = -r * options.intensity;
  return p;
}

}  // namespace

std::vector<Primitive> seedsFromResidual(const ResidualField& residual,
                                         const SeedOptions& options) {
  const auto voxels = drawVoxels(residual, options.draw);
  std::vector<Primitive> seeds(voxels.size());
  tbb::parallel_for(std::size_t(0), voxels.size(),
                    [&](std::size_t i) { seeds[i] = seedAt(residual, voxels[i], options); });
  return seeds;
}

double kernelVariance(const KernelConstants<double>& kernel) {
  constexpr int kSteps = 400;
  const double radius = supportRadius(kernel);
  double mass = 0.0, second = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    const double q = radius * (i + 0.5) / kSteps;
    const double weight = kernelPhi(kernel, q * q) * q * q;
    mass += weight;
    second += weight * q * q / 3.0;
  }
  return second / mass;
}

}  // namespace esvr
