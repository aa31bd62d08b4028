// Marches a NanoVDB grid on a CUDA device.

#include <algorithm>
#include <string>

#include "core/cuda/stream.h"
#include "core/cuda/use_device.h"
#include "esvr/error.h"
#include "render/cuda/device_table.h"
#include "render/cuda/event.h"
#include "render/cuda/make_cuda_renderer.h"
#include "render/cuda/nano_draw.h"
#include "render/nano_box.h"
#include "render/picture.h"

namespace esvr::cuda {
namespace {

Stream streamOn(const Device& device) {
  useDevice(device);
  return Stream();
}

class NanoRenderer final : public Renderer {
 public:
  NanoRenderer(const NanoVolume& volume, const Device& device, const RendererLimits& limits)
      : limits_(limits),
        stream_(streamOn(device)),
        values_(volume.values),
        background_(volume.background),
        box_(sampledBox(volume)),
        grid_(std::span(volume.data.get(), volume.bytes), stream_.get()) {}

  Image draw(const RenderOptions& options) override {
    Image image{options.resolution.width, options.resolution.height, {}};
    drawFrame(options, &image);
    return image;
  }
  void drawOnDevice(const RenderOptions& options) override { drawFrame(options, nullptr); }
  FrameStats stats() const override { return stats_; }

 private:
  void drawFrame(const RenderOptions& options, Image* image) {
    checkRenderOptions(options);
    if (image != nullptr)
      image->rgba.assign(std::size_t(4) * std::size_t(image->width) * std::size_t(image->height),
                         0.0f);
    stats_ = {.deviceBytes = stats_.deviceBytes};
    table_.update(options, stream_.get());
    const int rows = rowsOfBand(options.resolution);
    for (int first = 0; first < options.resolution.height; first += rows)
      drawBand(options, first, std::min(rows, options.resolution.height - first), image);
  }

  [[nodiscard]] int rowsOfBand(Resolution r) const {
    if (limits_.maxBytes == 0) return r.height;
    const std::size_t fixed = grid_.bytes() + table_.bytes();
    const std::size_t ofRow = std::size_t(r.width) * sizeof(float4);
    if (fixed + ofRow > limits_.maxBytes)
      throw DeviceError("marching voxels on the GPU needs more than " +
                        std::to_string(limits_.maxBytes) + " bytes");
    return int(std::min<std::uint64_t>((limits_.maxBytes - fixed) / ofRow, r.height));
  }

  void drawBand(const RenderOptions& o, int firstRow, int rows, Image* image) {
    checkCancelled(o);
    const std::size_t count = std::size_t(rows) * std::size_t(o.resolution.width);
    atLeast(pixels_, count, stream_.get());
    begin_.record(stream_.get());
    launchNano({.view = View(o.camera, o.resolution),
                .box = box_,
                .step = o.step,
                .clip = clipOf(o),
                .rule = sampleRule(o, table_.view(), background_),
                .grid = grid_.data(),
                .values = values_,
                .resolution = o.resolution,
                .firstRow = firstRow,
                .rows = rows,
                .pixels = pixels_.data()},
               stream_.get());
    drawn_.record(stream_.get());
    if (image != nullptr)
      check(cudaMemcpyAsync(
                &image->rgba[4 * std::size_t(firstRow) * std::size_t(o.resolution.width)],
                pixels_.data(), count * sizeof(float4), cudaMemcpyDeviceToHost, stream_.get()),
            "copying a picture from the device");
    stream_.synchronize();
    stats_.drawMs += drawn_.since(begin_);
    stats_.deviceBytes = std::max<std::uint64_t>(stats_.deviceBytes,
                                                 grid_.bytes() + table_.bytes() + pixels_.bytes());
  }

  RendererLimits limits_;
  Stream stream_;
  NanoValues values_;
  float background_;
  PlaceBox box_;
  DeviceBuffer<std::byte> grid_;
  DeviceBuffer<float4> pixels_;
  DeviceTable table_;
  Event begin_, drawn_;
  FrameStats stats_;
};

}  // namespace

std::unique_ptr<Renderer> makeCudaNanoRenderer(const NanoVolume& volume, const Device& device,
                                               const RendererLimits& limits) {
  return std::make_unique<NanoRenderer>(volume, device, limits);
}

}  // namespace esvr::cuda
