#include "render/cuda/march_renderer.cuh"

#include <algorithm>
#include <climits>
#include <string>

#include "core/cuda/reduce.cuh"
#include "core/cuda/runtime.h"
#include "esvr/error.h"
#include "render/picture.h"

namespace esvr::cuda {

// Bands.

namespace {

/// A band takes at most this part of limited memory. The rest is for bricks, because decoding them
/// again takes much longer than starting a further band: in 20 MB, aneurism with 59,000 ellipsoids
/// was drawn at 112 frames a second while the band came first (H200).
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

TileBand MarchRenderer::tileBand(const RenderOptions& o, Band band, double firstSample,
                                 float4* pixels) {
  const int tileRows = TileBand::tilesAlong(band.rows);
  makeRoom(ranges_, std::size_t(tileRows) * std::size_t(TileBand::tilesAlong(o.resolution.width)),
           stream());
  return {.resolution = o.resolution,
          .firstTileRow = band.firstRow / kMarchTileSide,
          .tileRows = tileRows,
          .ranges = ranges_.data(),
          .firstSample = firstSample,
          .pixels = pixels};
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

// The samples in which the rays of a tile may meet bricks.

namespace {

constexpr int kThreads = 128;

__global__ void clearRanges(int2* ranges, int tiles) {
  const int tile = int(threadNumber());
  if (tile < tiles) ranges[tile] = make_int2(INT_MAX, INT_MIN);
}

/// Lanes that look at a brick together, one for each corner.
constexpr int kLanes = kCellCorners;

/// The cover of a brick, on all lanes of its group.
__device__ BrickCover coverOf(const CoverView& v, const Coord& brick) {
  const BrickCover own = coverOfCorner(v, brick, int(threadIdx.x) % kLanes);
  const auto least = [](auto n) {
    return reduceLanes<kLanes>(n, [](auto x, auto y) { return x < y ? x : y; });
  };
  const auto largest = [](auto n) {
    return reduceLanes<kLanes>(n, [](auto x, auto y) { return x < y ? y : x; });
  };
  return {least(own.firstColumn),
          largest(own.lastColumn),
          least(own.firstRow),
          largest(own.lastRow),
          v.view.perspective ? firstSampleOf(v, brick) : least(own.first),
          largest(own.last)};
}

/// Widens the sample ranges of the tiles that a cover meets. The lanes of a group share them.
__device__ void widen(const TileBand& band, const CoverView& v, const BrickCover& c) {
  CoveredTiles tiles = tilesOf(v, c, kMarchTileSide);
  const int past = min(tiles.firstRow + tiles.rows, band.firstTileRow + band.tileRows);
  tiles.firstRow = max(tiles.firstRow, band.firstTileRow);
  const int count = tiles.columns * (past - tiles.firstRow);
  for (int n = int(threadIdx.x) % kLanes; n < count; n += kLanes) {
    const int row = tiles.firstRow - band.firstTileRow + n / tiles.columns;
    int2& range = band.ranges[row * TileBand::tilesAlong(band.resolution.width) +
                              tiles.firstColumn + n % tiles.columns];
    atomicMin(&range.x, c.first);
    atomicMax(&range.y, c.last);
  }
}

/// Each group of lanes looks at one brick and widens the sample range of every tile that the brick
/// may cover.
__global__ void __launch_bounds__(kThreads)
    widenRanges(const TileBand band, const CoveringBricks bricks) {
  const std::size_t brick = threadNumber() / kLanes;
  if (brick >= bricks.count) return;
  if (bricks.slotOf != nullptr && bricks.slotOf[bricks.first + brick] == BrickSlotsView::kVacant)
    return;
  const CoverView view{bricks.view, band.resolution, bricks.step, band.firstSample};
  widen(band, view, coverOf(view, bricks.bricks[brick]));
}

}  // namespace

void setRanges(const TileBand& band, std::span<const CoveringBricks> grids, cudaStream_t stream) {
  const int tiles = band.tiles();
  clearRanges<<<blocksFor(std::size_t(tiles), kThreads), kThreads, 0, stream>>>(band.ranges, tiles);
  check(cudaGetLastError(), "clearing tiles");
  for (const CoveringBricks& bricks : grids) {
    if (bricks.count == 0) continue;
    widenRanges<<<blocksFor(std::size_t(bricks.count) * kLanes, kThreads), kThreads, 0, stream>>>(
        band, bricks);
    check(cudaGetLastError(), "looking at bricks");
  }
}

}  // namespace esvr::cuda
