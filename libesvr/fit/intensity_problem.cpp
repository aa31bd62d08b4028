#include "fit/intensity_problem.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "fit/cuda/make_cuda.h"

namespace esvr {

std::unique_ptr<IntensityPasses> makeIntensityPasses(const IntensityTarget& target,
                                                     const Device& device) {
  if (device.kind == DeviceKind::kCuda) return makeCudaIntensityPasses(target, device);
  return makeCpuIntensityPasses(target);
}

std::vector<Coord> knownCorners(const IntensityTarget& target) {
  std::vector<Coord> corners(target.bricks.begin(), target.bricks.end());
  if (!target.restrictToBricks)
    for (std::size_t b = 0; b < target.source.brickCount(); ++b)
      corners.push_back(target.source.brickCorner(b));
  std::sort(corners.begin(), corners.end());
  corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
  return corners;
}

const float* sourceValues(const SparseVolume& source, Coord corner) {
  const auto at = brickWith(source, corner);
  return at ? source.brickValues(*at).data() : nullptr;
}

namespace {

/// Reduction of the preconditioned gradient's squared norm at which the iterations end.
constexpr double kConvergedRatio = 1e-10;

double dot(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

void addScaled(std::vector<double>& a, double scale, const std::vector<double>& b) {
  for (std::size_t i = 0; i < a.size(); ++i) a[i] += scale * b[i];
}

/// Intensities after a share of a step. If no intensity was negative, none becomes negative.
std::vector<float> moved(const std::vector<float>& intensities, const std::vector<double>& step,
                         double share) {
  const bool signs = std::any_of(intensities.begin(), intensities.end(),
                                 [](float intensity) { return intensity < 0.0f; });
  const double lowest = signs ? -HUGE_VAL : 0.0;
  std::vector<float> to(intensities.size());
  for (std::size_t i = 0; i < to.size(); ++i)
    to[i] = float(std::max(lowest, intensities[i] + share * step[i]));
  return to;
}

}  // namespace

/// The step x that reduces |A x + r|^2, computed from A^T r.
std::vector<double> IntensityProblem::conjugateGradients(int iterations) {
  const std::vector<double>& curvature = gradient_.curvature;
  std::vector<double> residual = gradient_.byIntensity;
  const std::size_t n = residual.size();
  std::vector<double> x(n), z(n), p(n), q;
  for (double& r : residual) r = -r;
  const auto precondition = [&] {
    for (std::size_t i = 0; i < n; ++i)
      z[i] = curvature[i] > 0.0 ? residual[i] / curvature[i] : 0.0;
  };
  precondition();
  p = z;
  double rho = dot(residual, z);
  const double converged = rho * kConvergedRatio;
  for (int k = 0; k < iterations && rho > converged; ++k) {
    CancelScope::check();
    passes_->applyNormal(p, q);
    const double alpha = rho / dot(p, q);
    if (!std::isfinite(alpha)) break;
    addScaled(x, alpha, p);
    addScaled(residual, -alpha, q);
    precondition();
    const double next = dot(residual, z);
    const double beta = next / rho;
    rho = next;
    for (std::size_t i = 0; i < n; ++i) p[i] = z[i] + beta * p[i];
  }
  return x;
}

double IntensityProblem::step(std::vector<float>& intensities, int iterations) {
  const double before = passes_->gradient(intensities, gradient_).squares;
  intensities = moved(intensities, conjugateGradients(iterations), 1.0);
  return before;
}

double IntensityProblem::solve(std::vector<float>& intensities, int iterations) {
  const double before = passes_->gradient(intensities, gradient_).squares;
  const auto step = conjugateGradients(iterations);
  for (double share = 1.0; share > 0.1; share *= 0.5) {
    CancelScope::check();
    auto tried = moved(intensities, step, share);
    const double after = passes_->error(tried).squares;
    if (!(after < before)) continue;
    intensities = std::move(tried);
    return after;
  }
  return before;
}

std::vector<float> intensitiesOf(const Field& field) {
  std::vector<float> all;
  for (const auto& chunk : field.chunks)
    all.insert(all.end(), chunk.ellipsoids.intensity.begin(), chunk.ellipsoids.intensity.end());
  return all;
}

void setIntensities(std::span<const float> intensities, Field& field) {
  for (auto& chunk : field.chunks) {
    auto& own = chunk.ellipsoids.intensity;
    std::copy_n(intensities.begin(), own.size(), own.begin());
    intensities = intensities.subspan(own.size());
  }
}

}  // namespace esvr
