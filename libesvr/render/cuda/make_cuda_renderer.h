#pragma once
/// Makes the renderers for a CUDA device. The functions exist in every build, and this header does
/// not include those of CUDA.

#include "esvr/renderer.h"

namespace esvr::cuda {

/// \throws DeviceError  the device does not exist, its memory is exhausted, or the build has no
///                      CUDA
[[nodiscard]] std::unique_ptr<Renderer> makeCudaFieldRenderer(const Field& field,
                                                              const Device& device,
                                                              const RendererLimits& limits,
                                                              const RevoxeliseOptions& voxels);
/// Draws the voxels of a field, which are decoded on the device brick by brick.
/// \throws DeviceError     as for makeCudaFieldRenderer
/// \throws RuntimeFailure, UsageError  as for makeCellField
[[nodiscard]] std::unique_ptr<Renderer> makeCudaCellRenderer(const Field& field,
                                                             const Device& device,
                                                             const RendererLimits& limits,
                                                             const RevoxeliseOptions& voxels);
/// Draws the voxels of a volume, which must outlive the renderer.
/// \throws DeviceError  as for makeCudaFieldRenderer
/// \throws UsageError   the voxels lie too far apart for the tables of a BrickAtlas
[[nodiscard]] std::unique_ptr<Renderer> makeCudaVolumeRenderer(const SparseVolume& volume,
                                                               const Device& device,
                                                               const RendererLimits& limits);
/// \throws DeviceError  as for makeCudaFieldRenderer
[[nodiscard]] std::unique_ptr<Renderer> makeCudaNanoRenderer(const NanoVolume& volume,
                                                             const Device& device,
                                                             const RendererLimits& limits);
/// Draws several grids (makeGridsRenderer).
/// \throws DeviceError  as for makeCudaFieldRenderer
/// \throws RuntimeFailure, UsageError  as for makeCudaCellRenderer and makeCudaVolumeRenderer
[[nodiscard]] std::unique_ptr<Renderer> makeCudaGridsRenderer(const std::vector<DrawnGrid>& grids,
                                                              const Device& device,
                                                              const RendererLimits& limits);

}  // namespace esvr::cuda
