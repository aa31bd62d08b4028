#pragma once
/// An ellipsoid as the paper's method moves it, and what is remembered of it.

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "esvr/kernel.h"
#include "fit/ellipsoid.h"

namespace esvr::paper {

struct PaperEllipsoid {
  std::array<double, 3> center;    ///< voxels relative to the volume's origin
  std::array<double, 3> logScale;  ///< of the paper's scales (Sigma = R S S^T R^T), voxels
  std::array<double, 4> rotation;  ///< quaternion w, x, y, z of any length but 0
  double intensity;                ///< in units of FitTarget::scale
  double k;                        ///< of this ellipsoid, where it is learned
};

/// Order: center (3), logScale (3), rotation (4), intensity, k.
inline constexpr int kPaperParameters = 12;
using PaperVector = std::array<double, kPaperParameters>;

/// Adam's moments, and the gradients by position since the last densification.
struct PaperState {
  std::array<float, kPaperParameters> m{}, v{};
  double gradientSum = 0.0;  ///< of lengths
  std::uint32_t seen = 0;    ///< visits to subvolumes that the ellipsoid reaches
};

struct Population {
  std::vector<PaperEllipsoid> ellipsoids;
  std::vector<PaperState> states;

  [[nodiscard]] std::size_t size() const { return ellipsoids.size(); }
};

/// Which kernel the paper's scales are meant for.
struct KernelKind {
  bool gaussian = false, learnK = false;
  double k = 5.0;

  /// Scales of the unit frame (ellipsoid.h) go so many times into the paper's: with m = k q for
  /// ellipsoids and m = q / 2 for Gaussians, q = d^T Sigma^-1 d.
  [[nodiscard]] ESVR_HD double unitsPerScale(double ofEllipsoid) const {
    return std::sqrt(gaussian ? 0.5 : (learnK ? ofEllipsoid : k));
  }
};

/// The scene's kernel: the paper's ellipsoid, or a Gaussian that ends at 3 sigma.
[[nodiscard]] inline Kernel kernelOf(const KernelKind& kind) {
  constexpr float kGaussian = -30.0f;  // e^-30 from the limit
  constexpr double kSigmas = 3.0;
  if (kind.gaussian)
    return {KernelForm::kContinuous, kGaussian, float(std::exp(-0.5 * kSigmas * kSigmas))};
  return {KernelForm::kPaper, float(kind.k), Kernel::kDefaultEpsilon};
}

}  // namespace esvr::paper
