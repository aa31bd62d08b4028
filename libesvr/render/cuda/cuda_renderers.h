#pragma once
/// What the rest of the library draws and decodes on a CUDA device. The functions exist in every
/// build, and this header does not include those of CUDA.

#include <span>

#include "esvr/render.h"

namespace esvr::cuda {

/// Draws the sum of ellipsoids.
/// \throws DeviceError  the device does not exist, its memory is exhausted, or the build has no
///                      CUDA
[[nodiscard]] std::unique_ptr<Renderer> makeCudaSumRenderer(const Field& field,
                                                            const Device& device,
                                                            const RendererLimits& limits,
                                                            const RevoxeliseOptions& voxels);
/// Draws the voxels of a field, which are decoded on the device brick by brick.
/// \throws DeviceError     as for makeCudaSumRenderer
/// \throws RuntimeFailure, UsageError  as for makeCellField
[[nodiscard]] std::unique_ptr<Renderer> makeCudaCellRenderer(const Field& field,
                                                             const Device& device,
                                                             const RendererLimits& limits,
                                                             const RevoxeliseOptions& voxels);
/// Draws the voxels of a volume, which must outlive the renderer.
/// \throws DeviceError  as for makeCudaSumRenderer
/// \throws UsageError   the voxels lie too far apart for the tables of a BrickAtlas
[[nodiscard]] std::unique_ptr<Renderer> makeCudaVolumeRenderer(const SparseVolume& volume,
                                                               const Device& device,
                                                               const RendererLimits& limits);
/// Draws a NanoVDB grid.
/// \throws DeviceError  as for makeCudaSumRenderer
[[nodiscard]] std::unique_ptr<Renderer> makeCudaNanoRenderer(const NanoVolume& volume,
                                                             const Device& device,
                                                             const RendererLimits& limits);
/// Draws several grids (makeGridsRenderer).
/// \throws DeviceError  as for makeCudaSumRenderer
/// \throws RuntimeFailure, UsageError  as for makeCudaCellRenderer and makeCudaVolumeRenderer
[[nodiscard]] std::unique_ptr<Renderer> makeCudaGridsRenderer(const std::vector<DrawnGrid>& grids,
                                                              const Device& device,
                                                              const RendererLimits& limits);

/// Evaluates V at all voxels of bricks with the decoder of the renderers, for comparisons with the definition.
/// \param corners  index corners of the bricks, multiples of 8, increasing
/// \param out      kBrickVoxels values for each brick, in voxelOffset order
/// \throws DeviceError  as for makeCudaSumRenderer
/// \throws MemoryExceeded  as for reachedBricks (field.h)
/// \throws UsageError  the bounding box of the bricks has more than 2^28 blocks of 64^3 voxels
void decodeBricks(const Device& device, const Field& field, std::span<const Coord> corners,
                  std::span<float> out);

}  // namespace esvr::cuda
