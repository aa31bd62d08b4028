#pragma once
/// Decides when ellipsoids have moved so far that the pair lists must be built again. The code is
/// compiled for host and device.
///
/// A list holds every brick that an ellipsoid's support reaches, and some more: the support is
/// widened by a slack, which is a share of its radius, since steps too are shares of an ellipsoid's
/// size. A step that would lead the ellipsoid's core out of its listed support is refused. The core
/// leaves out the rim of a support, where phi is small. The lists end as soon as the number of
/// refused steps exceeds a share of the number of ellipsoids. They are therefore rebuilt often
/// while steps are large, and rarely while steps are small.
///
/// docs/lab-notes.md has the measurements ("When pair lists are built again").

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "fit/ellipsoid.h"

namespace esvr {

/// A support at the time when the lists were built. It is wider than the ellipsoid's support by a
/// slack, so that the ellipsoid can move before the lists must be built again.
struct ListedSupport {
  std::array<double, 3> center;
  Matrix3 L;
  double reach;  ///< radius in the unit frame, including the slack
  bool refused;  ///< true if a step was refused since the lists were built
};

/// The support of an ellipsoid that no list has held, which gets the largest slack.
[[nodiscard]] inline ListedSupport unlisted(const Ellipsoid& p) {
  return {p.center, p.L, 0.0, true};
}

/// The rule that chooses the slack and ends the lists.
struct SlackRule {
  double missedShare = 0.05;     ///< share of its intensity that a list may miss of an ellipsoid
  double minSlack = 0.15;        ///< voxels
  double maxSlack = 0.25;        ///< share of the radius, where minSlack is less
  double slackOverMotion = 0.9;  ///< slack over the motion since the lists before
  /// An ellipsoid that took fewer steps gets maxSlack. So does one whose step was refused, because
  /// its next step would be refused too.
  std::uint32_t settledSteps = 4;
  double refusedShare = 0.03;  ///< refused steps per ellipsoid that end the lists

  /// \return the number of refused steps that ends lists of `count` ellipsoids
  [[nodiscard]] std::uint32_t refusedSteps(std::size_t count) const {
    return std::uint32_t(refusedShare * double(count)) + 1;
  }
};

/// \return the radius in the unit frame beyond which phi is below `share`
[[nodiscard]] ESVR_HD inline double coreRadius(const KernelConstants<double>& k, double share) {
  return std::sqrt(k.shift + std::log(k.numerator / (k.base + share) - k.plateau));
}

namespace motion_bound {

using Eigen::Matrix3d;
using ellipsoid_math::asEigen;

/// Distance that the center has moved, in the unit frame of the listed support.
ESVR_HD inline double offsetFrom(const ListedSupport& listed, const Ellipsoid& p) {
  const Eigen::Vector3d d(p.center[0] - listed.center[0], p.center[1] - listed.center[1],
                          p.center[2] - listed.center[2]);
  return (asEigen(listed.L) * d).norm();
}

/// M^T M for M = L_listed F, which maps the unit frame of the ellipsoid to that of its listed
/// support.
ESVR_HD inline Matrix3d squaredStretch(const ListedSupport& listed, const Ellipsoid& p) {
  const Matrix3 F = inverse(p.L);
  const Matrix3d M = asEigen(listed.L) * asEigen(F);
  return M.transpose() * M;
}

/// Tests a symmetric matrix by Sylvester's criterion.
ESVR_HD inline bool positiveDefinite(const Matrix3d& S) {
  const double minor = S(0, 0) * S(1, 1) - S(0, 1) * S(0, 1);
  return S(0, 0) > 0.0 && minor > 0.0 && S.determinant() > 0.0;
}

/// An upper bound of the largest eigenvalue, computed from trace and norm (Wolkowicz and Styan
/// 1980). It is exact if the other two eigenvalues are equal.
ESVR_HD inline double largestEigenvalueBound(const Matrix3d& S) {
  const double mean = S.trace() / 3.0;
  const double variance = S.squaredNorm() / 3.0 - mean * mean;
  return mean + std::sqrt(2.0 * (variance > 0.0 ? variance : 0.0));
}

}  // namespace motion_bound

/// \return true if the listed support contains the ellipsoid's support of radius `radius`. False if
///         the ellipsoid is not finite.
[[nodiscard]] ESVR_HD inline bool isHeld(const ListedSupport& listed, const Ellipsoid& p,
                                         double radius) {
  using namespace motion_bound;
  const double left = (listed.reach - offsetFrom(listed, p)) / radius;
  if (!(left > 0.0)) return false;
  return positiveDefinite(left * left * Matrix3d::Identity() - squaredStretch(listed, p));
}

/// Refuses a step that leads an ellipsoid out of its listed support: moves it back, and leaves its
/// intensity changed. \return whether the step was refused
[[nodiscard]] ESVR_HD inline bool refuseStep(ListedSupport& listed, double radius,
                                             const Ellipsoid& before, Ellipsoid& p) {
  if (isHeld(listed, p, radius)) return false;
  listed.refused = true;
  p.center = before.center;
  p.L = before.L;
  return true;
}

/// \return the slack that would have held an ellipsoid, at most: a share of its radius
[[nodiscard]] ESVR_HD inline double motionSince(const ListedSupport& listed, const Ellipsoid& p,
                                                double radius) {
  using namespace motion_bound;
  const double stretch = std::sqrt(largestEigenvalueBound(squaredStretch(listed, p)));
  return offsetFrom(listed, p) / radius + stretch - 1.0;
}

/// The slack for the next lists, as a share of the radius.
/// \param steps   number of steps that the ellipsoid has taken
/// \param before  its support in the last lists; not used for fewer than settledSteps steps
[[nodiscard]] ESVR_HD inline double slackOf(const Ellipsoid& p, std::uint32_t steps,
                                            const ListedSupport& before, double radius,
                                            const SlackRule& rule) {
  const Matrix3 F = inverse(p.L);
  const double meanHalf = radius * std::sqrt(ellipsoid_math::norm2(F) / 3.0);  // voxels
  const double low = rule.minSlack / meanHalf;
  const double high = low > rule.maxSlack ? low : rule.maxSlack;
  if (steps < rule.settledSteps || before.refused) return high;
  const double wanted = rule.slackOverMotion * motionSince(before, p, radius);
  return wanted > low ? (wanted < high ? wanted : high) : low;
}

/// \return the support for the next lists
[[nodiscard]] ESVR_HD inline ListedSupport listedSupport(const Ellipsoid& p, std::uint32_t steps,
                                                         const ListedSupport& before, double radius,
                                                         const SlackRule& rule) {
  return {p.center, p.L, radius * (1.0 + slackOf(p, steps, before, radius, rule)), false};
}

}  // namespace esvr
