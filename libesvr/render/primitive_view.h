#pragma once
/// Ellipsoids as a camera sees them.

#include <cstdint>
#include <vector>

#include "esvr/ellipsoids.h"
#include "render/view.h"

namespace esvr {

/// A function of the place (x, y) in the plane of the picture.
template <class Value>
struct LinearInPlane {
  Value atOrigin, perX, perY;
};

/// In an ellipsoid's unit frame, u = S^-1 R^T (p - center), a ray starts at o and runs along v, and
/// everything that is asked of it is linear in the place of its pixel. All of it is float64: a
/// camera may be a million voxels away.
struct PrimitiveView {
  LinearInPlane<Vec3> along;    ///< v
  LinearInPlane<Vec3> beside;   ///< o x v: its length over that of v is the distance to the center
  LinearInPlane<double> ahead;  ///< o . v: negative where the center lies ahead
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
