#pragma once
/// An ellipsoid in the parameters of the paper's method, and the state of its optimisation.

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "esvr/kernel.h"
#include "fit/ellipsoid.h"

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

}  // namespace esvr::paper
