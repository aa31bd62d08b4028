#pragma once
/// Converts a Field to the fit's ellipsoids, the inverse of export_field.h.

#include <vector>

#include "esvr/ellipsoids.h"
#include "fit/ellipsoid.h"

namespace esvr {

/// The ellipsoids of all chunks, in their order.
/// \param origin  origin of the volume, index coordinates
/// \param scale   see FitTarget::scale
[[nodiscard]] std::vector<Ellipsoid> importField(const Field& field, Coord origin, double scale);

}  // namespace esvr
