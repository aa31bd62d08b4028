#include "render/cuda/march_renderer.h"

#include <algorithm>
#include <string>

#include "core/cuda/use_device.h"
#include "esvr/error.h"
#include "render/picture.h"

namespace esvr::cuda {
namespace {

/// A band takes at most this part of limited memory. The rest is for bricks, because decoding them
/// again takes much longer than starting a further band: in 20 MB, aneurism with 59,000 ellipsoids was
/// drawn at 112 frames a second while the band came first (H200).
constexpr std::uint64_t kBandShare = 8;

}  // namespace

MarchRenderer::MarchRenderer(const Device& device, const RendererLimits& limits)
    : limits_(limits), stream_(streamOn(device)) {}

Image MarchRenderer::draw(const RenderOptions& options) {
  Image image{options.resolution.width, options.resolution.height, {}};
  drawFrame(options, &image);
  return image;
}

void MarchRenderer::drawFrame(const RenderOptions& options, Image* image) {
  checkRenderOptions(options, gridCount());
  if (image != nullptr)
    image->rgba.assign(std::size_t(4) * std::size_t(image->width) * std::size_t(image->height),
                       0.0f);
  stats_ = {.deviceBytes = stats_.deviceBytes};
  prepare(options);
  const int rows = rowsOfBand(options.resolution);
  for (int first = 0; first < options.resolution.height; first += rows)
    drawBand(options, {first, std::min(rows, options.resolution.height - first)}, image);
}

TransferTableView MarchRenderer::table(std::size_t number, const TransferFunction& transfer,
                                       const Sampling& sampling) {
  if (tables_.size() <= number) tables_.resize(number + 1);
  tables_[number].update(transfer, sampling, stream());
  return tables_[number].view();
}

std::size_t MarchRenderer::tableBytes() const {
  std::size_t bytes = 0;
  for (const DeviceTable& table : tables_) bytes += table.bytes();
  return bytes;
}

int MarchRenderer::rowsOfBand(Resolution r) {
  if (limits_.maxBytes == 0) return r.height;
  const std::size_t fixed = fixedBytes() + tableBytes();
  const std::size_t ofRow = std::size_t(r.width) * sizeof(float4) + bytesOfRow(r);
  if (fixed + ofRow * kBandRows > limits_.maxBytes)
    throw DeviceError("marching voxels on the GPU needs more than " +
                      std::to_string(limits_.maxBytes) + " bytes");
  const std::uint64_t room = limits_.maxBytes - fixed;
  const std::uint64_t forBand = decodesBricks() ? room / kBandShare : room;
  const std::uint64_t rows =
      std::min(std::max<std::uint64_t>(forBand / ofRow / kBandRows * kBandRows, kBandRows),
               std::uint64_t(r.height));
  shareMemory(room - std::min<std::uint64_t>(room, rows * ofRow));
  return int(rows);
}

void MarchRenderer::drawBand(const RenderOptions& o, Band band, Image* image) {
  checkCancelled(o);
  const std::size_t width = std::size_t(o.resolution.width);
  const std::size_t count = std::size_t(band.rows) * width;
  makeRoom(pixels_, count, stream());
  begin_.record(stream());
  pixels_.setZero();
  launch(o, band, pixels_.data());
  drawn_.record(stream());
  if (image != nullptr)
    check(cudaMemcpyAsync(&image->rgba[4 * std::size_t(band.firstRow) * width], pixels_.data(),
                          count * sizeof(float4), cudaMemcpyDeviceToHost, stream()),
          "copying a picture from the device");
  stream_.synchronize();
  stats_.drawMs += drawn_.millisecondsSince(begin_);
  stats_.deviceBytes =
      std::max<std::uint64_t>(stats_.deviceBytes, contentBytes() + tableBytes() + pixels_.bytes());
}

}  // namespace esvr::cuda
