#pragma once
/// Ellipsoids for the voxels of windows.

#include <vector>

#include "esvr/ellipsoids.h"
#include "render/lattice_form.h"
#include "render/primitive_math.h"

namespace esvr {

[[nodiscard]] LatticeForm latticeForm(const PackedEllipsoid& e, const RayKernel& kernel);

/// In the order of `packed`.
[[nodiscard]] std::vector<LatticeForm> latticeForms(const Field& field);

}  // namespace esvr
