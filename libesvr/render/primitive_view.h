#pragma once
/// Ellipsoids as a camera sees them.

#include <cstdint>
#include <vector>

#include "esvr/ellipsoids.h"
#include "render/view.h"

namespace esvr {

/// The ellipsoid's unit frame, L = S^-1 R^T, applied once to what every ray is made of. All of it
/// is float64: a camera may be a million voxels away.
struct PrimitiveView {
  Vec3 eye;                 ///< L (eye - center)
  Vec3 right, up, forward;  ///< L times the view's axes
  KernelConstants<float> kernel;
  float intensity;
};

/// A support's bounds, errs on the side of inclusion.
struct ScreenBounds {
  std::int32_t firstColumn, lastColumn, firstRow, lastRow;  ///< pixels whose rays may meet it
  double nearest, farthest;                                 ///< along forward, not below 0
};

/// The ellipsoids that some ray of the picture may meet, in their order in the field.
struct VisiblePrimitives {
  std::vector<PrimitiveView> views;
  std::vector<ScreenBounds> bounds;
};

[[nodiscard]] VisiblePrimitives visiblePrimitives(const Field& field, const View& view,
                                                  Resolution resolution);

}  // namespace esvr
