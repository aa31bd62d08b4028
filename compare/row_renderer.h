#pragma once
/// Makes the renderer of a row's pictures on the selected device.

#include <memory>

#include "esvr/renderer.h"

namespace esvr::compare {

/// A renderer of voxels: of a NanoVDB grid of this value type on a CUDA device, of the volume
/// itself on the CPU.
/// \throws DeviceError  as for makeNanoRenderer
[[nodiscard]] std::unique_ptr<Renderer> makeVoxelRenderer(const SparseVolume& volume,
                                                          NanoValues values, const Device& device);

}  // namespace esvr::compare
