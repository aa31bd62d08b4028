#pragma once
/// How far away a scene begins and ends.

#include <optional>

#include "esvr/render.h"
#include "render/ray_box.h"
#include "render/seen_ellipsoid.h"

namespace esvr {

/// Around the supports of all ellipsoids; nothing where there are none.
[[nodiscard]] std::optional<PlaceBox> supportBox(const Field& field);

/// The part of a support's box that shows: with the cells around its voxels, where these are
/// interpolated.
[[nodiscard]] PlaceBox shownBox(const PlaceBox& support, Between between);

/// The bins of the rays' samples that may lie in a box; last < first where none does.
[[nodiscard]] BinRange binsWithin(const PlaceBox& box, const View& view, double step);

/// \throws UsageError  rays that pass all these bins have more than 2^24 samples
void checkRayLength(const BinRange& bins);

}  // namespace esvr
