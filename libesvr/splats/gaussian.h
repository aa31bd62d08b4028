#pragma once
/// The optics of Gaussians: what a splat and a part of a density have in common. docs/splats.md has the
/// derivations. And what writers and readers of files of splats have in common.

#include <array>
#include <string>

#include "core/geometry.h"
#include "esvr/ellipsoids.h"

namespace esvr::splats {

using Sizes = std::array<double, 3>;

/// The Gaussian a exp(-|u|^2 / (2 width^2)) that stands for a kernel phi(|u|^2).
struct KernelGaussian {
  double
      width;  ///< its standard deviation, which is that of the kernel along any axis, in units of the scales
  double volume;  ///< the integral of the kernel over space, in units of the product of the scales
};
[[nodiscard]] KernelGaussian gaussianOf(const Kernel& kernel, double kappa);

/// The kernel whose ellipsoids are Gaussians exp(-m), cut where they are below a ten-thousandth.
[[nodiscard]] Kernel gaussianKernel();

/// The integral of a Gaussian of that kernel over space, in units of the product of its standard deviations:
/// (2 pi)^1.5, less what the cut takes.
[[nodiscard]] double gaussianVolume();

/// The mean area of the projections of an ellipsoid along all directions, divided by pi: a quarter of its
/// surface (Cauchy), and s^2 for a ball of the radius s.
[[nodiscard]] double meanShadow(Sizes halfAxes);

/// The integral of -ln(1 - alpha exp(-t)) over t from 0 on, which is the dilogarithm of alpha: the optical depth
/// of a splat, summed over a picture, in units of 2 pi times its shadow. \param alpha  from 0 to 1
[[nodiscard]] double depthOfAlpha(double alpha);

/// The quaternion of a rotation's matrix, with w >= 0.
[[nodiscard]] Quaternion quaternionOf(const Matrix3& rotation);
/// The rotation by b and then by a.
[[nodiscard]] Quaternion product(const Quaternion& a, const Quaternion& b);

/// The rotation and the sizes of a Gaussian whose standard deviations are the columns of a matrix.
struct PrincipalGaussian {
  Quaternion rotation;  ///< unit length, w >= 0
  Sizes sizes;          ///< decreasing
};
[[nodiscard]] PrincipalGaussian principalAxesOf(const Matrix3& columns);

/// The factor by which the sizes of a splat grew when its depth became an opacity, so that the depth, summed over a
/// picture, stayed what it was. \param depth  through the center, of which `alpha` is the share that is hidden
[[nodiscard]] double widening(double depth, double alpha);

/// The alphas that all formats keep: whole numbers of 255ths.
inline constexpr double kAlphaSteps = 255.0;

/// The first spherical harmonic, and the color of a splat whose coefficients are 0.
inline constexpr double kFirstHarmonic = 0.28209479177387814, kMiddleColor = 0.5;

// The first words of the comments in our PLY files. Each has its value behind it.
inline constexpr const char* kMatrixWord = "esvr_to_world";  ///< SplatScene::toWorld, 16 numbers
inline constexpr const char* kUpWord = "esvr_up";            ///< y or z
inline constexpr const char* kDensityWord = "esvr_density_scale";
inline constexpr const char* kGridWord = "esvr_grid";
inline constexpr const char* kLatticeWord =
    "esvr_index_to_world";  ///< SplatScene::indexToWorld, 16 numbers

// What these comments may say. Numbers beyond would overflow, and are none of a scene.
inline constexpr double kLeastNumber = 1e-30, kMostNumber = 1e30;
[[nodiscard]] inline bool isUsualScale(double scale) {
  return scale > kLeastNumber && scale < kMostNumber;
}
/// What is wrong with SplatScene::toWorld; empty: nothing.
[[nodiscard]] std::string faultOfToWorld(const std::array<double, 16>& toWorld);
/// What is wrong with SplatScene::indexToWorld; empty: nothing.
[[nodiscard]] std::string faultOfLattice(const std::array<double, 16>& indexToWorld);

}  // namespace esvr::splats
