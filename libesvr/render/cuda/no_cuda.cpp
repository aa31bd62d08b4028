#include "core/device_choice.h"
#include "render/cuda/cuda_renderers.h"

namespace esvr::cuda {

std::unique_ptr<Renderer> makeCudaSumRenderer(const Field&, const Device& device,
                                              const RendererLimits&, const RevoxeliseOptions&) {
  refuseCuda("drawing", device);
}

std::unique_ptr<Renderer> makeCudaCellRenderer(const Field&, const Device& device,
                                               const RendererLimits&, const RevoxeliseOptions&) {
  refuseCuda("drawing", device);
}

std::unique_ptr<Renderer> makeCudaVolumeRenderer(const SparseVolume&, const Device& device,
                                                 const RendererLimits&) {
  refuseCuda("drawing", device);
}

std::unique_ptr<Renderer> makeCudaNanoRenderer(const NanoVolume&, const Device& device,
                                               const RendererLimits&) {
  refuseCuda("drawing", device);
}

std::unique_ptr<Renderer> makeCudaGridsRenderer(const std::vector<DrawnGrid>&, const Device& device,
                                                const RendererLimits&) {
  refuseCuda("drawing", device);
}

void decodeBricks(const Device& device, const Field&, std::span<const Coord>, std::span<float>) {
  refuseCuda("evaluating bricks", device);
}

}  // namespace esvr::cuda
