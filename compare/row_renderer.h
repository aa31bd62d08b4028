#pragma once
/// What draws the pictures of a row, on the device that was asked for.

#include <memory>

#include "esvr/grid_coding.h"
#include "esvr/renderer.h"

namespace esvr::compare {

/// Voxels as others hold them: on a CUDA device a NanoVDB grid of these values, which is marched;
/// on the CPU the voxels themselves, whose pictures are those of floats. \throws DeviceError
[[nodiscard]] std::unique_ptr<Renderer> makeVoxelRenderer(const SparseVolume& volume,
                                                          NanoValues values, const Device& device);

/// True where a grid's ellipsoids say all: not of a narrow band, of which they say nothing beyond
/// it, nor where voxels, a residual or a mask are stored.
[[nodiscard]] bool saysAll(const StoredGrid& grid);

}  // namespace esvr::compare
