#pragma once
/// Projects the ellipsoids of a field into a picture.

#include <cstdint>
#include <vector>

#include "esvr/render.h"
#include "render/seen_ellipsoid.h"

namespace esvr {

/// The ellipsoids that at least one ray of the picture may meet, in the order of the field.
struct VisibleEllipsoids {
  std::vector<ScreenBounds> bounds;
  std::vector<EllipsoidView> views;
};

[[nodiscard]] VisibleEllipsoids visibleEllipsoids(const Field& field, const View& view,
                                                  Resolution resolution);

/// The ellipsoids of all chunks of a field in one array.
[[nodiscard]] std::vector<PackedEllipsoid> packed(const Field& field);
/// The origins of the chunks. Centers of ellipsoids are relative to them.
[[nodiscard]] std::vector<Vec3> chunkOrigins(const Field& field);
/// One kernel if all ellipsoids share it, otherwise one for each in the order of packed().
[[nodiscard]] std::vector<RayKernel> rayKernels(const Field& field);

}  // namespace esvr
