#pragma once
/// The order of a chunk's ellipsoids in the file. Neighbours in space are neighbours in the
/// streams, which then compress better and are evaluated with fewer cache misses.

#include "esvr/ellipsoids.h"

namespace esvr::format {

/// Returns the ellipsoids in Morton order of their centers, which must be finite. Ellipsoids of one
/// cell keep their order, so that sorting again changes nothing.
[[nodiscard]] Ellipsoids inMortonOrder(const Ellipsoids& ellipsoids);

}  // namespace esvr::format
