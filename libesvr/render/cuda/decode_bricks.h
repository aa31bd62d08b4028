#pragma once
/// Decodes given bricks of a field on a CUDA device. The function exists in every build, and this
/// header does not include those of CUDA.

#include <span>

#include "esvr/coord.h"
#include "esvr/device.h"
#include "esvr/ellipsoids.h"

namespace esvr::cuda {

/// The arguments and exceptions are those of evaluateBricksOn (esvr/device_bricks.h).
void decodeBricks(const Device& device, const Field& field, std::span<const Coord> corners,
                  std::span<float> out);

}  // namespace esvr::cuda
