#pragma once
/// The order of a chunk's ellipsoids in the file: neighbours in space are neighbours in the
/// streams, which compresses better and evaluates with fewer cache misses.

#include "esvr/ellipsoids.h"

namespace esvr::format {

/// The ellipsoids in Morton order of their centers; those of one cell keep their order, so that
/// sorting again changes nothing. Centers must be finite.
[[nodiscard]] Ellipsoids inMortonOrder(const Ellipsoids& ellipsoids);

}  // namespace esvr::format
