#include "esvr/renderer.h"

#include <chrono>
#include <string>

#include "esvr/error.h"
#include "render/cuda/make_cuda_renderer.h"

namespace esvr {
namespace {

constexpr int kMostDepthParts = 16;

/// Draws with a function of render.h.
template <class Content, Image (*kDraw)(const Content&, const RenderOptions&)>
class CpuRenderer final : public Renderer {
 public:
  explicit CpuRenderer(const Content& content) : content_(content) {}

  Image draw(const RenderOptions& options) override {
    const auto begin = std::chrono::steady_clock::now();
    Image image = kDraw(content_, options);
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
    stats_.drawMs = took.count();
    return image;
  }
  void drawOnDevice(const RenderOptions& options) override { (void)draw(options); }
  FrameStats stats() const override { return stats_; }

 private:
  const Content& content_;
  FrameStats stats_;
};

}  // namespace

std::unique_ptr<Renderer> makeFieldRenderer(const Field& field, const Device& device,
                                            const RendererLimits& limits) {
  if (limits.depthParts < 0 || limits.depthParts > kMostDepthParts)
    throw UsageError("parts of the depth must be from 1 to " + std::to_string(kMostDepthParts) +
                     ", or 0 to have them chosen");
  if (device.kind == DeviceKind::kCuda) return cuda::makeCudaFieldRenderer(field, device, limits);
  return std::make_unique<CpuRenderer<Field, renderField>>(field);
}

std::unique_ptr<Renderer> makeVolumeRenderer(const SparseVolume& volume, const Device& device,
                                             const RendererLimits& limits) {
  if (device.kind == DeviceKind::kCuda) return cuda::makeCudaVolumeRenderer(volume, device, limits);
  return std::make_unique<CpuRenderer<SparseVolume, renderVolume>>(volume);
}

std::unique_ptr<Renderer> makeNanoRenderer(const NanoVolume& volume, const Device& device,
                                           const RendererLimits& limits) {
  if (device.kind == DeviceKind::kCuda) return cuda::makeCudaNanoRenderer(volume, device, limits);
  return std::make_unique<CpuRenderer<NanoVolume, renderNano>>(volume);
}

}  // namespace esvr
