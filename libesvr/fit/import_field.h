#pragma once
/// The way back from what files store to the fit's own form (export_field.h).

#include <vector>

#include "esvr/ellipsoids.h"
#include "fit/ellipsoid.h"

namespace esvr {

/// The ellipsoids of all chunks, one behind the other. \param origin  of the volume, index
/// coordinates \param scale  FitTarget::scale
[[nodiscard]] std::vector<Ellipsoid> importField(const Field& field, Coord origin, double scale);

}  // namespace esvr
