#include <string>

#include "core/cuda_probe.h"
#include "esvr/error.h"
#include "render/cuda/make_cuda_renderer.h"

namespace esvr::cuda {

namespace {

[[noreturn]] void refuse(const Device& device) {
  throw DeviceError("drawing on cuda:" + std::to_string(device.index) + ": " +
                    probeCuda().whyNoDevices);
}

}  // namespace

std::unique_ptr<Renderer> makeCudaFieldRenderer(const Field&, const Device& device,
                                                const RendererLimits&, const RevoxeliseOptions&) {
  refuse(device);
}

std::unique_ptr<Renderer> makeCudaVolumeRenderer(const SparseVolume&, const Device& device,
                                                 const RendererLimits&) {
  refuse(device);
}

std::unique_ptr<Renderer> makeCudaNanoRenderer(const NanoVolume&, const Device& device,
                                               const RendererLimits&) {
  refuse(device);
}

}  // namespace esvr::cuda
