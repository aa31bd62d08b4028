#pragma once
/// The ellipsoids of a field that are most difficult to evaluate.

#include <vector>

#include "esvr/stability.h"

namespace esvr {

/// The voxels nearest to the centers of the ellipsoids with the smallest and the largest scale, the
/// largest aspect ratio and the largest intensity.
[[nodiscard]] std::vector<Coord> centersOfExtremes(const Field& field);

}  // namespace esvr
