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

/// How slack is chosen. Measured on aneurism and smoke1 with 2000 ellipsoids, 300 iterations and
/// three seeds: lists are as long as with half a voxel for all ellipsoids (39,900 pairs for 39,700,
/// and 16,800 for 17,900), and are built anew 83 times, where every tenth iteration and every event
/// had made it 41.
struct SlackRule {
  double missedShare = 0.05;       ///< share of its intensity that a list may miss of an ellipsoid
  double minSlack = 0.15;          ///< voxels
  double maxSlack = 0.25;          ///< share of the radius, where minSlack is less
  double slackOverMotion = 0.9;    ///< slack over the motion since the lists before
  std::uint32_t settledSteps = 4;  ///< an ellipsoid that is younger gets maxSlack
};

}  // namespace esvr
