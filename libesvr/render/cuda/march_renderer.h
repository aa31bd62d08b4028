#pragma once
/// Renderers that march through voxels on a CUDA device share this: bands, pixels, times.

#include "core/cuda/event.h"
#include "core/cuda/stream.h"
#include "esvr/renderer.h"
#include "render/cuda/device_table.h"

namespace esvr::cuda {

class MarchRenderer : public Renderer {
 public:
  Image draw(const RenderOptions& options) override;
  void drawOnDevice(const RenderOptions& options) override { drawFrame(options, nullptr); }
  [[nodiscard]] FrameStats stats() const override { return stats_; }

 protected:
  /// Rows of pixels. Bands begin at multiples of kBandRows.
  struct Band {
    int firstRow, rows;
  };
  static constexpr int kBandRows = 8;

  MarchRenderer(const Device& device, const RendererLimits& limits);

  /// \param pixels  of the band, zero
  virtual void launch(const RenderOptions& options, Band band, float4* pixels) = 0;
  /// Bytes of device memory beside the pixels and the table.
  [[nodiscard]] virtual std::size_t contentBytes() const = 0;
  /// Bytes that each row of pixels takes beside them.
  [[nodiscard]] virtual std::size_t bytesOfRow(Resolution) const { return 0; }

  [[nodiscard]] cudaStream_t stream() const { return stream_.get(); }
  [[nodiscard]] const DeviceTable& table() const { return table_; }

 private:
  void drawFrame(const RenderOptions& options, Image* image);
  void drawBand(const RenderOptions& options, Band band, Image* image);
  [[nodiscard]] int rowsOfBand(Resolution resolution) const;

  RendererLimits limits_;
  Stream stream_;
  DeviceBuffer<float4> pixels_;
  DeviceTable table_;
  Event begin_, drawn_;
  FrameStats stats_;
};

}  // namespace esvr::cuda
