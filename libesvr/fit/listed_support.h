#pragma once
/// What lists of pairs hold of an ellipsoid, and by how much more than its support.

#include <array>
#include <cstdint>

#include "field/line_form.h"

namespace esvr {

/// A support as it was listed.
struct ListedSupport {
  std::array<double, 3> center;
  Matrix3 L;
  double reach;  ///< its radius in the unit frame, slack included
};

/// How slack is chosen. docs/lab-notes.md, "When lists of pairs are built anew", compares this rule
/// with others.
struct SlackRule {
  double missedShare = 0.05;       ///< share of its intensity that a list may miss of an ellipsoid
  double minSlack = 0.15;          ///< voxels
  double maxSlack = 0.25;          ///< share of the radius, where minSlack is less
  double slackOverMotion = 0.9;    ///< slack over the motion since the lists before
  std::uint32_t settledSteps = 4;  ///< an ellipsoid that is younger gets maxSlack
};

}  // namespace esvr
