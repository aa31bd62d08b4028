#pragma once
/// The range of depths in which a scene lies.

#include <optional>

#include "esvr/render.h"
#include "render/ray_box.h"
#include "render/seen_ellipsoid.h"

namespace esvr {

/// A box around the supports of all ellipsoids; nothing if there are no ellipsoids.
[[nodiscard]] std::optional<PlaceBox> supportBox(const Field& field);

/// The bins whose samples may lie in a box; empty if last < first.
[[nodiscard]] BinRange binsWithin(const PlaceBox& box, const View& view, double step);

/// \throws UsageError  a ray has more than kMostRaySamples samples in these bins
void checkRayLength(const BinRange& bins);

}  // namespace esvr
