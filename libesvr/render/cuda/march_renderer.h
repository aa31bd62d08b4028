#pragma once
/// Base class of the CUDA renderers that march through voxels. It manages bands, pixels and times.

#include <vector>

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
  /// A band of the picture, in rows of pixels. Bands begin at multiples of kBandRows.
  struct Band {
    int firstRow, rows;
  };
  static constexpr int kBandRows = 8;

  MarchRenderer(const Device& device, const RendererLimits& limits);

  /// The number of grids that RenderOptions must have looks for.
  [[nodiscard]] virtual std::size_t gridCount() const { return 1; }
  /// Makes what the bands of a picture share.
  virtual void prepare(const RenderOptions& options) = 0;
  /// Draws a band. \param pixels  pixels of the band, which are zero before
  virtual void launch(const RenderOptions& options, Band band, float4* pixels) = 0;
  /// Bytes of device memory, without the pixels and the transfer function's table.
  [[nodiscard]] virtual std::size_t contentBytes() const = 0;
  /// The smallest number of these bytes with which a picture can be drawn.
  [[nodiscard]] virtual std::size_t fixedBytes() const { return contentBytes(); }
  /// Whether memory that is left is used for bricks that are decoded when rays ask for them.
  [[nodiscard]] virtual bool decodesBricks() const { return false; }
  /// Tells how many bytes of RendererLimits::maxBytes are left beside the fixed ones and a band.
  virtual void shareMemory(std::uint64_t /*left*/) {}
  /// Bytes that each row of pixels takes in addition to the pixels.
  [[nodiscard]] virtual std::size_t bytesOfRow(Resolution) const { return 0; }

  [[nodiscard]] cudaStream_t stream() const { return stream_.get(); }
  /// The tables of a transfer function. Those of the last picture are reused if they have not changed.
  /// \param number  tells apart the tables of a picture; 0 or above, without gaps
  [[nodiscard]] TransferTableView table(std::size_t number, const TransferFunction& transfer,
                                        const Sampling& sampling);

 private:
  void drawFrame(const RenderOptions& options, Image* image);
  void drawBand(const RenderOptions& options, Band band, Image* image);
  [[nodiscard]] int rowsOfBand(Resolution resolution);
  [[nodiscard]] std::size_t tableBytes() const;

  RendererLimits limits_;
  Stream stream_;
  DeviceBuffer<float4> pixels_;
  std::vector<DeviceTable> tables_;
  Event begin_, drawn_;
  FrameStats stats_;
};

}  // namespace esvr::cuda
