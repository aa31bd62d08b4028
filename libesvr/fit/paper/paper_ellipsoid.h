#pragma once
/// An ellipsoid in the parameters of the paper's method: its kernel, its form in the passes, and
/// the gradient and the step of one ellipsoid, for host and device.

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/geometry.h"
#include "esvr/ellipsoids.h"
#include "fit/adam.h"

namespace esvr::paper {

struct PaperEllipsoid {
  std::array<double, 3> center;    ///< voxels relative to the volume's origin
  std::array<double, 3> logScale;  ///< logarithms of the paper's scales (Sigma = R S S^T R^T)
  std::array<double, 4> rotation;  ///< quaternion w, x, y, z of any length above 0
  double intensity;                ///< units of the target (FitTarget::scale)
  double k;                        ///< sharpness of this ellipsoid if it is learned
};

/// The order of a gradient: center (3), logScale (3), rotation (4), intensity, k.
inline constexpr int kPaperParameters = 12;
using PaperVector = std::array<double, kPaperParameters>;

/// Adam's moments, and the gradients by position since the last densification.
struct PaperState {
  std::array<float, kPaperParameters> m{}, v{};
  double gradientSum = 0.0;  ///< sum of the gradients' lengths
  std::uint32_t seen = 0;    ///< number of visits to subvolumes that the ellipsoid reaches
};

struct Population {
  std::vector<PaperEllipsoid> ellipsoids;
  std::vector<PaperState> states;

  [[nodiscard]] std::size_t size() const { return ellipsoids.size(); }
};

/// The kernel of the paper's ellipsoids.
struct KernelKind {
  bool gaussian = false, learnK = false;
  double k = 5.0;

  /// The paper's scale divided by that of the unit frame (ellipsoid.h): m = k q for ellipsoids and
  /// m = q / 2 for Gaussians, with q = d^T Sigma^-1 d.
  [[nodiscard]] ESVR_HD double unitsPerScale(double ofEllipsoid) const {
    return std::sqrt(gaussian ? 0.5 : (learnK ? ofEllipsoid : k));
  }
};

/// The kernel of the field: the paper's ellipsoid, or a Gaussian that ends at 3 sigma.
[[nodiscard]] inline Kernel kernelOf(const KernelKind& kind) {
  constexpr float kGaussian = -30.0f;  // kappa, for which the kernel is a Gaussian to within e^-30
  constexpr double kSigmas = 3.0;
  if (kind.gaussian)
    return {KernelForm::kContinuous, kGaussian, float(std::exp(-0.5 * kSigmas * kSigmas))};
  return {KernelForm::kPaper, float(kind.k), Kernel::kDefaultEpsilon};
}

/// Converts an ellipsoid to the form of the passes: L = units S^-1 R^T.
ESVR_HD inline Ellipsoid ellipsoidOf(const PaperEllipsoid& p, const KernelKind& kind) {
  const Matrix3 R = rotationOf(normalised(p.rotation));
  const double units = kind.unitsPerScale(p.k);
  Ellipsoid unit{p.center, {}, p.intensity};
  for (int j = 0; j < 3; ++j) {
    const double inverse = units * std::exp(-p.logScale[j]);
    for (int i = 0; i < 3; ++i) unit.L[3 * j + i] = inverse * R[3 * i + j];
  }
  return unit;
}

/// The constants of an ellipsoid's kernel.
inline KernelConstants<double> constantsOf(const PaperEllipsoid& p, const KernelKind& kind) {
  const Kernel kernel = kernelOf(kind);
  return kernelConstants<double>(kernel, kind.learnK ? p.k : double(kernel.kappa));
}

/// The parameters of a step.
struct PaperStep {
  PaperVector rates{};                    ///< rate of each parameter; voxels for the position
  double positionUnit = 1.0;              ///< half the longest axis, voxels
  double correct1 = 1.0, correct2 = 1.0;  ///< 1 / (1 - beta^steps)
  double smallestLogScale = 0.0, largestLogScale = 0.0;
};

/// Adam's constants in 3D Gaussian Splatting.
inline constexpr double kBeta1 = 0.9, kBeta2 = 0.999, kAdamEpsilon = 1e-15;
/// Limits of a learned k. Below, an ellipsoid has no edge; above, its edge is far thinner than a
/// voxel.
inline constexpr double kSmallestK = 0.5, kLargestK = 50.0;

namespace paper_math {

/// The derivatives by the angles of a turn about the ellipsoid's own axes. With the generator W of
/// the turn, A = S^-1 W S changes L to exp(-A) L, and the loss depends on the symmetric part of A.
ESVR_HD inline std::array<double, 3> byTurn(const PaperEllipsoid& p, const ParameterVector& g) {
  const auto skew = [&](int j, int k) {
    return 0.5 *
           (std::exp(p.logScale[k] - p.logScale[j]) - std::exp(p.logScale[j] - p.logScale[k]));
  };
  return {-g[8] * skew(1, 2), g[7] * skew(0, 2), -g[6] * skew(0, 1)};
}

/// The derivatives by a quaternion's components. A turn by t about the ellipsoid's axis j adds
/// t/2 (q e_j) to a unit quaternion.
ESVR_HD inline std::array<double, 4> byQuaternion(const PaperEllipsoid& p,
                                                  const std::array<double, 3>& turn) {
  const std::array<double, 4> q = normalised(p.rotation);
  const double w = q[0], x = q[1], y = q[2], z = q[3];
  const double scale = 2.0 / lengthOf(p.rotation);
  const double a = scale * turn[0], b = scale * turn[1], c = scale * turn[2];
  return {-x * a - y * b - z * c, w * a - z * b + y * c, z * a + w * b - x * c,
          -y * a + x * b + w * c};
}

}  // namespace paper_math

/// Converts the gradient in the ellipsoid's own frame (ellipsoid.h) to that by the paper's
/// parameters.
/// \param unit  ellipsoidOf(p)
ESVR_HD inline PaperVector byPaperParameters(const PaperEllipsoid& p, const Ellipsoid& unit,
                                             const EllipsoidGradient& gradient) {
  const ParameterVector& g = gradient.byParameter;
  PaperVector out{};
  // center = F delta, hence d/d center = L^T d/d delta
  for (int i = 0; i < 3; ++i)
    out[i] = unit.L[i] * g[0] + unit.L[3 + i] * g[1] + unit.L[6 + i] * g[2];
  for (int j = 0; j < 3; ++j) out[3 + j] = g[3 + j];
  const auto turn = paper_math::byTurn(p, g);
  const auto quaternion = paper_math::byQuaternion(p, turn);
  for (int j = 0; j < 4; ++j) out[6 + j] = quaternion[j];
  out[10] = g[9];
  // the derivative is taken at fixed q = m / k, so m grows with k
  out[11] = edgeGradient(gradient, 1.0 / p.k);
  return out;
}

/// Adds the gradient's length to the state's sum and takes Adam's step.
/// \param reached  true if the visited subvolume contains voxels that the ellipsoid reaches
ESVR_HD inline void takeStep(PaperEllipsoid& p, PaperState& state, const PaperVector& gradient,
                             bool reached, const PaperStep& step) {
  if (reached) {
    const double x = gradient[0], y = gradient[1], z = gradient[2];
    state.gradientSum += step.positionUnit * std::sqrt(x * x + y * y + z * z);
    ++state.seen;
  }
  PaperVector by{};
  for (int i = 0; i < kPaperParameters; ++i) {
    state.m[i] = float(kBeta1 * state.m[i] + (1.0 - kBeta1) * gradient[i]);
    state.v[i] = float(kBeta2 * state.v[i] + (1.0 - kBeta2) * gradient[i] * gradient[i]);
    by[i] = -step.rates[i] * step.correct1 * state.m[i] /
            (std::sqrt(step.correct2 * state.v[i]) + kAdamEpsilon);
  }
  const auto clamped = [](double v, double low, double high) {
    return v < low ? low : (v > high ? high : v);
  };
  for (int i = 0; i < 3; ++i) {
    p.center[i] += by[i];
    p.logScale[i] = clamped(p.logScale[i] + by[3 + i], step.smallestLogScale, step.largestLogScale);
  }
  for (int i = 0; i < 4; ++i) p.rotation[i] += by[6 + i];
  p.intensity += by[10];
  p.k = clamped(p.k + by[11], kSmallestK, kLargestK);
}

}  // namespace esvr::paper
