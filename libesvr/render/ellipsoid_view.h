#pragma once
/// Ellipsoids as a camera sees them.

#include <cstdint>
#include <vector>

#include "esvr/render.h"
#include "render/seen_ellipsoid.h"
#include "render/window_form.h"

namespace esvr {

/// The ellipsoids that some ray of the picture may meet, in their order in the field.
struct VisibleEllipsoids {
  std::vector<ScreenBounds> bounds;
  std::vector<EllipsoidView> views;  ///< for Between::kSum
  std::vector<WindowForm> forms;     ///< for Between::kVoxels
};

[[nodiscard]] VisibleEllipsoids visibleEllipsoids(const Field& field, const View& view,
                                                  Resolution resolution, Between between);

/// A field's ellipsoids as they are handed to a camera; `chunk` counts the field's chunks.
[[nodiscard]] std::vector<PackedEllipsoid> packed(const Field& field);
/// The origins that the chunks' centers are relative to.
[[nodiscard]] std::vector<Vec3> chunkOrigins(const Field& field);
/// One kernel for all ellipsoids, or one for each, in the order of `packed`.
[[nodiscard]] std::vector<RayKernel> rayKernels(const Field& field);

}  // namespace esvr
