// Draws a NanoVDB grid, the reference for pictures and speed.
#include <optional>
#include <stdexcept>

#include "core/cuda/runtime.h"
#include "render/cuda/cuda_renderers.h"
#include "render/cuda/march_renderer.cuh"
#include "render/nano_march.h"
#include "render/picture.h"

namespace esvr::cuda {
namespace {

constexpr unsigned kColumns = 8, kRows = 16;  // pixels of a block of threads

/// Where the pixels of a band are written.
struct BandPixels {
  int width, firstRow, rows;
  float4* pixels;
};

template <class Build>
__global__ void __launch_bounds__(kColumns* kRows)
    nanoKernel(const nanovdb::NanoGrid<Build>* grid, const MarchScene scene, const BandPixels out) {
  const int column = int(blockIdx.x * kColumns + threadIdx.x);
  const int row = int(blockIdx.y * kRows + threadIdx.y);
  if (column >= out.width || row >= out.rows) return;
  const PixelColor c = marchNano(*grid, scene, column, row + out.firstRow);
  out.pixels[std::size_t(row) * std::size_t(out.width) + std::size_t(column)] =
      make_float4(c.r, c.g, c.b, c.alpha);
}

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
    const View view = viewOf(o, box_);
    if (box_.low[0] <= box_.high[0]) checkRayLength(binsWithin(box_, view, o.step));
    scene_ = {view, box_, o.step, clipOf(o),
              sampleRule(o, table(0, o.transfer, samplingOf(o)), background_)};
  }
  void launch(const RenderOptions& o, Band band, float4* pixels) override {
    const BandPixels out{o.resolution.width, band.firstRow, band.rows, pixels};
    switch (values_) {
      case NanoValues::kFloat:
        return launchAs<float>(out);
      case NanoValues::kFp4:
        return launchAs<nanovdb::Fp4>(out);
      case NanoValues::kFp8:
        return launchAs<nanovdb::Fp8>(out);
      case NanoValues::kFp16:
        return launchAs<nanovdb::Fp16>(out);
      case NanoValues::kFpN:
        return launchAs<nanovdb::FpN>(out);
    }
    throw std::logic_error("drawing NanoVDB: no such values");
  }
  template <class Build>
  void launchAs(const BandPixels& out) const {
    const dim3 threads(kColumns, kRows);
    const dim3 blocks((unsigned(out.width) + kColumns - 1) / kColumns,
                      (unsigned(out.rows) + kRows - 1) / kRows);
    nanoKernel<Build><<<blocks, threads, 0, stream()>>>(
        reinterpret_cast<const nanovdb::NanoGrid<Build>*>(grid_.data()), *scene_, out);
    check(cudaGetLastError(), "marching voxels");
  }
  std::size_t contentBytes() const override { return grid_.bytes(); }

  NanoValues values_;
  float background_;
  PlaceBox box_;
  std::optional<MarchScene> scene_;  ///< of the picture that is drawn
  DeviceBuffer<std::byte> grid_;
};

}  // namespace

std::unique_ptr<Renderer> makeCudaNanoRenderer(const NanoVolume& volume, const Device& device,
                                               const RendererLimits& limits) {
  return std::make_unique<NanoRenderer>(volume, device, limits);
}

}  // namespace esvr::cuda
