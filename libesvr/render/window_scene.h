#pragma once
/// Brings the ellipsoids of a field into the form for voxel windows.

#include <vector>

#include "esvr/ellipsoids.h"
#include "render/seen_ellipsoid.h"
#include "render/window_form.h"

namespace esvr {

[[nodiscard]] WindowForm windowForm(const PackedEllipsoid& e, const RayKernel& kernel);

/// The forms of all ellipsoids, in the order of packed().
[[nodiscard]] std::vector<WindowForm> windowForms(const Field& field);

}  // namespace esvr
