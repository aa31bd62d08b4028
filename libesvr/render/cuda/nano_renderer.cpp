// The renderer that marches rays through a NanoVDB grid on a CUDA device.

#include <optional>

#include "render/cuda/make_cuda_renderer.h"
#include "render/cuda/march_renderer.h"
#include "render/cuda/nano_draw.h"
#include "render/nano_box.h"
#include "render/picture.h"
#include "render/scene_depth.h"

namespace esvr::cuda {
namespace {

class NanoRenderer final : public MarchRenderer {
 public:
  NanoRenderer(const NanoVolume& volume, const Device& device, const RendererLimits& limits)
      : MarchRenderer(device, limits),
        values_(volume.values),
        background_(volume.background),
        box_(sampledBox(volume)),
        grid_(std::span(volume.data.get(), volume.bytes), stream()) {}

 private:
  void prepare(const RenderOptions& o) override {
    refuseShading(o);
    view_ = viewOf(o, box_);
    if (box_.low[0] <= box_.high[0]) checkRayLength(binsWithin(box_, *view_, o.step));
    table_ = table(0, o.transfer, samplingOf(o));
  }
  void launch(const RenderOptions& o, Band band, float4* pixels) override {
    launchNano({.view = *view_,
                .box = box_,
                .step = o.step,
                .clip = clipOf(o),
                .rule = sampleRule(o, table_, background_),
                .grid = grid_.data(),
                .values = values_,
                .resolution = o.resolution,
                .firstRow = band.firstRow,
                .rows = band.rows,
                .pixels = pixels},
               stream());
  }
  std::size_t contentBytes() const override { return grid_.bytes(); }

  TransferTableView table_{};
  NanoValues values_;
  float background_;
  PlaceBox box_;
  std::optional<View> view_;  ///< of the picture that is drawn
  DeviceBuffer<std::byte> grid_;
};

}  // namespace

std::unique_ptr<Renderer> makeCudaNanoRenderer(const NanoVolume& volume, const Device& device,
                                               const RendererLimits& limits) {
  return std::make_unique<NanoRenderer>(volume, device, limits);
}

}  // namespace esvr::cuda
