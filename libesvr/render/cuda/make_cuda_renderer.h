#pragma once
/// The renderers of a CUDA device, in every build; free of CUDA's own headers.

#include "esvr/renderer.h"

namespace esvr::cuda {

/// \throws DeviceError  no such device, out of memory; always, in a build without CUDA
[[nodiscard]] std::unique_ptr<Renderer> makeCudaFieldRenderer(const Field& field,
                                                              const Device& device,
                                                              const RendererLimits& limits,
                                                              const RevoxeliseOptions& voxels);
/// From bricks. \throws  as above; UsageError: voxels too far apart
[[nodiscard]] std::unique_ptr<Renderer> makeCudaVolumeRenderer(const SparseVolume& volume,
                                                               const Device& device,
                                                               const RendererLimits& limits);
/// \throws  as above
[[nodiscard]] std::unique_ptr<Renderer> makeCudaNanoRenderer(const NanoVolume& volume,
                                                             const Device& device,
                                                             const RendererLimits& limits);

}  // namespace esvr::cuda
