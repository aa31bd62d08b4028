#pragma once
/// The support of an ellipsoid as it is entered into the pair lists, and the rule for its slack.

#include <array>
#include <cstddef>
#include <cstdint>

#include "field/line_form.h"
#include "fit/ellipsoid.h"

namespace esvr {

/// A support at the time when the lists were built. It is wider than the ellipsoid's support by a
/// slack, so that the ellipsoid can move before the lists must be built again (motion_bound.h).
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

/// The rule that chooses the slack and ends the lists. docs/lab-notes.md has the measurements
/// ("When pair lists are built again").
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

}  // namespace esvr
