#pragma once
/// Evaluates a field on bricks with the arithmetic of a device, for comparisons with other devices
/// and with the definition (stability.h).

#include <span>

#include "esvr/coord.h"
#include "esvr/device.h"
#include "esvr/ellipsoids.h"
#include "esvr/stability.h"

namespace esvr {

/// Evaluates V at all voxels of bricks as the device does: on the CPU with evaluateBricks()
/// (field.h), by which files become voxels, and on a GPU with the decoder of the renderers
/// (renderer.h).
/// \param corners  index corners of the bricks, multiples of 8, increasing
/// \param out      kBrickVoxels values for each brick, in voxelOffset order
/// \throws DeviceError  the device does not exist, the build has no CUDA, or memory is exhausted
/// \throws MemoryExceeded  as for reachedBricks (field.h)
/// \throws UsageError  on a GPU: the bounding box of the bricks has more than 2^28 blocks of 64^3
///                     voxels
void evaluateBricksOn(const Device& device, const Field& field, std::span<const Coord> corners,
                      std::span<float> out);

/// The arithmetic of evaluateBricksOn() on a device.
[[nodiscard]] Arithmetic arithmeticOf(const Device& device);

}  // namespace esvr
