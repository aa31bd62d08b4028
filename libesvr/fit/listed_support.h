#pragma once
/// The support of an ellipsoid as it is entered into the pair lists, and the rule for its slack.

#include <array>
#include <cstdint>

#include "field/line_form.h"

namespace esvr {

/// A support at the time when the lists were built. It is wider than the ellipsoid's support by a
/// slack, so that the ellipsoid can move before the lists must be built again (motion_bound.h).
struct ListedSupport {
  std::array<double, 3> center;
  Matrix3 L;
  double reach;  ///< radius in the unit frame, including the slack
};

/// The rule for the slack. It was compared with other rules (docs/lab-notes.md, "When lists of
/// pairs are built anew").
struct SlackRule {
  /// Lists may miss the part of a support in which |value| is below this share of the intensity.
  double missedShare = 0.05;
  double minSlack = 0.15;          ///< smallest slack, voxels
  double maxSlack = 0.25;          ///< largest slack as a share of the radius, if above minSlack
  double slackOverMotion = 0.9;    ///< slack relative to the motion since the last lists
  std::uint32_t settledSteps = 4;  ///< ellipsoids with fewer steps get the largest slack
};

}  // namespace esvr
