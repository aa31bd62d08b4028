#include "esvr/renderer.h"

#include <chrono>
#include <string>
#include <utility>

#include "esvr/error.h"
#include "render/cuda/make_cuda_renderer.h"

namespace esvr {
namespace {

/// A renderer on the CPU, which calls a function of render.h for each picture.
template <class Draw>
class CpuRenderer final : public Renderer {
 public:
  explicit CpuRenderer(Draw draw) : draw_(std::move(draw)) {}

  Image draw(const RenderOptions& options) override {
    const auto begin = std::chrono::steady_clock::now();
    Image image = draw_(options);
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
    stats_.drawMs = took.count();
    return image;
  }
  void drawOnDevice(const RenderOptions& options) override { (void)draw(options); }
  FrameStats stats() const override { return stats_; }

 private:
  Draw draw_;
  FrameStats stats_;
};

template <class Draw>
std::unique_ptr<Renderer> makeCpuRenderer(Draw draw) {
  return std::make_unique<CpuRenderer<Draw>>(std::move(draw));
}

}  // namespace

std::unique_ptr<Renderer> makeFieldRenderer(const Field& field, const Device& device,
                                            const RendererLimits& limits,
                                            const RevoxeliseOptions& voxels) {
  if (limits.depthParts < 0 || limits.depthParts > RendererLimits::kMaxDepthParts)
    throw UsageError("parts of the depth must be from 1 to " +
                     std::to_string(RendererLimits::kMaxDepthParts) + ", or 0 to have them chosen");
  if (device.kind == DeviceKind::kCuda)
    return cuda::makeCudaFieldRenderer(field, device, limits, voxels);
  return makeCpuRenderer(
      [&field, voxels](const RenderOptions& o) { return renderField(field, o, voxels); });
}

std::unique_ptr<Renderer> makeVolumeRenderer(const SparseVolume& volume, const Device& device,
                                             const RendererLimits& limits) {
  if (device.kind == DeviceKind::kCuda) return cuda::makeCudaVolumeRenderer(volume, device, limits);
  return makeCpuRenderer([&volume](const RenderOptions& o) { return renderVolume(volume, o); });
}

std::unique_ptr<Renderer> makeNanoRenderer(const NanoVolume& volume, const Device& device,
                                           const RendererLimits& limits) {
  if (device.kind == DeviceKind::kCuda) return cuda::makeCudaNanoRenderer(volume, device, limits);
  return makeCpuRenderer([&volume](const RenderOptions& o) { return renderNano(volume, o); });
}

}  // namespace esvr
