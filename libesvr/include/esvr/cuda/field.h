#pragma once
/// Evaluates a Field on a CUDA device. Declared in every build; free of CUDA's own headers.

#include <span>

#include "esvr/coord.h"
#include "esvr/device.h"
#include "esvr/ellipsoids.h"

namespace esvr {

/// As evaluateBricks (field.h), with the bounds on the error stated there: the two differ by at
/// most twice these. A brick's ellipsoids are added in their order in the field, without atomics,
/// so a result is the same bits in every run and whatever other bricks are asked for.
///
/// Blocks until `out` is filled. Makes the device current for the calling thread. Takes about 80
/// bytes of its memory an ellipsoid (28 more where each has its own kappa), and 256 MiB at most for
/// the bricks, which are done in batches.
/// \param corners  index corners, multiples of 8
/// \param out      kBrickVoxels a brick, in voxelOffset order
/// \throws DeviceError       no such CUDA device, no driver, a build without CUDA, out of memory;
///                           says which
/// \throws std::logic_error  `out` does not fit `corners`
void evaluateBricksCuda(const Field& field, std::span<const Coord> corners, std::span<float> out,
                        const Device& device);

}  // namespace esvr
