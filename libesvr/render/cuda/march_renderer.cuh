#pragma once
/// What the CUDA renderers that march through voxels have in common: bands of the picture and their
/// times, the tiles of a band with the samples in which their rays may meet bricks, and the rays
/// that wait for bricks.

#include <cuda_runtime_api.h>

#include <cstdint>
#include <optional>
#include <vector>

#include "core/cuda/device_buffer.h"
#include "core/cuda/runtime.h"
#include "esvr/render.h"
#include "render/cuda/cell_store.h"
#include "render/sample_rule.h"

namespace esvr::cuda {

/// A transfer function's tables on the device.
class DeviceTable {
 public:
  /// Makes the table anew only if the transfer function or its sampling changed, because making it
  /// can take longer than drawing a picture.
  void update(const TransferFunction& transfer, const Sampling& sampling, cudaStream_t stream) {
    if (known_ && known_->sampling == sampling && known_->transfer == transfer) return;
    known_ = {transfer, sampling, TransferTable(transfer, sampling)};
    copy(known_->table.values(), values_, stream);
    copy(known_->table.segments(), segments_, stream);
  }
  /// Must be called after update().
  [[nodiscard]] TransferTableView view() const {
    return known_->table.on(values_.data(), segments_.data());
  }
  [[nodiscard]] std::size_t bytes() const { return values_.bytes() + segments_.bytes(); }

 private:
  struct Known {
    TransferFunction transfer;
    Sampling sampling;
    TransferTable table;
  };

  template <class Entry>
  static void copy(const std::vector<Entry>& from, DeviceBuffer<Entry>& to, cudaStream_t stream) {
    if (from.empty()) return;
    makeRoom(to, from.size(), stream);
    to.upload(from);
  }

  std::optional<Known> known_;
  DeviceBuffer<Classified> values_;
  DeviceBuffer<SegmentEntry> segments_;
};

// The tiles of a band. Each block of threads draws one tile and each thread one ray.

inline constexpr int kMarchTileSide = 8;  ///< pixels
inline constexpr int kMarchTilePixels = kMarchTileSide * kMarchTileSide;

/// The tiles of a band of a picture. All pointers are to device memory.
struct TileBand {
  Resolution resolution;       ///< of the picture
  int firstTileRow, tileRows;  ///< rows of tiles in this band of the picture
  int2* ranges;                ///< for each tile: first and last sample, counted from firstSample
  double firstSample;          ///< the first sample, counted from the eye
  float4* pixels;              ///< pixels of the band; must be zero before

  [[nodiscard]] ESVR_HD static int tilesAlong(int pixels) {
    return (pixels + kMarchTileSide - 1) / kMarchTileSide;
  }
  [[nodiscard]] ESVR_HD int tiles() const { return tilesAlong(resolution.width) * tileRows; }
};

/// Bricks that rays may meet.
struct CoveringBricks {
  View view;                   ///< relative to the origin of the bricks
  double step;                 ///< distance of samples, in the voxels of the bricks
  const Coord* bricks;         ///< places relative to the table's origin
  std::uint32_t first, count;  ///< number of the first of them, and how many there are
  /// Bricks that are vacant here do not count; null: all count.
  const std::uint32_t* slotOf;
};

/// Sets the ranges of all tiles to the samples in which their rays may meet the bricks of any grid.
void setRanges(const TileBand& band, std::span<const CoveringBricks> grids, cudaStream_t stream);

/// Base class of the renderers. It manages bands, pixels and times.
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
  static_assert(kBandRows % kMarchTileSide == 0);

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
  /// The tiles of a band, with room for their ranges. \param firstSample  see TileBand
  [[nodiscard]] TileBand tileBand(const RenderOptions& options, Band band, double firstSample,
                                  float4* pixels);
  [[nodiscard]] std::size_t tileBytes() const { return ranges_.bytes(); }
  /// The tables of a transfer function. Those of the last picture are reused if they have not
  /// changed.
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
  DeviceBuffer<int2> ranges_;
  std::vector<DeviceTable> tables_;
  Event begin_, drawn_;
  FrameStats stats_;
};

// The tiles whose rays wait for bricks.

/// The tiles whose rays go on in a pass. All pointers are to device memory.
/// \tparam Kept  KeptRay or KeptGridsRay
template <class Kept>
struct WaitingTiles {
  std::uint32_t count = 0;                 ///< 0: the tiles are those of the whole band
  bool begin = false;                      ///< the entries are all tiles, and their rays begin now
  const std::uint32_t* entries = nullptr;  ///< numbers in `tiles` and `rays`
  const std::uint32_t* tiles = nullptr;    ///< by entry: number of the tile
  Kept* rays = nullptr;                    ///< by entry: kMarchTilePixels rays
  Shade* shades = nullptr;                 ///< shades of the rays; null: they are not shaded
};

/// The memory of the tiles that wait, which grows with their number. The list of entries is a
/// stack: a pass takes entries from its end, and those that wait again return to it.
template <class Kept>
class WaitingMemory {
 public:
  explicit WaitingMemory(cudaStream_t stream)
      : stream_(stream), found_(stream), entries_(stream), tiles_(stream) {}

  /// Memory for the numbers of waiting tiles or entries.
  std::uint32_t* found(std::size_t tiles) { return found_.reserve(tiles); }

  /// Takes the tiles that were found after the first pass; their rays begin anew.
  WaitingTiles<Kept> begin(std::uint32_t count, bool isShaded) {
    copy(tiles_.reserve(count), count);
    makeRoom(rays_, std::size_t(count) * kMarchTilePixels, stream_);
    if (isShaded) makeRoom(shades_, std::size_t(count) * kMarchTilePixels, stream_);
    (void)entries_.reserve(count);
    return {count,         true,         entries_.data(),
            tiles_.data(), rays_.data(), isShaded ? shades_.data() : nullptr};
  }
  /// Puts the entries that were found in a pass behind the first `kept` entries, and takes the last
  /// `most` of all.
  /// \param tiles  those of an earlier pass
  WaitingTiles<Kept> next(WaitingTiles<Kept> tiles, std::uint32_t kept, std::uint32_t count,
                          std::uint32_t most) {
    copy(entries_.data() + kept, count);
    tiles.begin = false;
    tiles.count = count + kept < most ? count + kept : most;
    tiles.entries = entries_.data() + (kept + count - tiles.count);
    return tiles;
  }
  [[nodiscard]] std::size_t bytes() const {
    return found_.bytes() + entries_.bytes() + tiles_.bytes() + rays_.bytes() + shades_.bytes();
  }

 private:
  void copy(std::uint32_t* to, std::uint32_t count) {
    if (count == 0) return;
    check(
        cudaMemcpyAsync(to, found_.data(), count * sizeof(*to), cudaMemcpyDeviceToDevice, stream_),
        "listing waiting rays");
  }

  cudaStream_t stream_;
  GrowingBuffer<std::uint32_t> found_, entries_, tiles_;
  DeviceBuffer<Kept> rays_;
  DeviceBuffer<Shade> shades_;
};

/// Bytes of device memory that a row of tiles takes besides its pixels.
/// \param waits  whether rays can wait
template <class Kept>
[[nodiscard]] std::size_t bytesOfTileRow(Resolution resolution, bool waits, bool isShaded) {
  const std::size_t ofRay = sizeof(Kept) + (isShaded ? sizeof(Shade) : 0);
  const std::size_t ofWaiting = kMarchTilePixels * ofRay + 3 * sizeof(std::uint32_t);
  return std::size_t(TileBand::tilesAlong(resolution.width)) *
         (sizeof(int2) + (waits ? ofWaiting : 0));
}

// Kernels.

/// Asks for a missing brick, unless another ray has.
__device__ inline void askFor(const BrickDemand& demand, std::uint32_t brick, std::uint32_t slot) {
  constexpr auto kMissing = BrickSlotsView::kMissing, kAsked = BrickSlotsView::kAsked;
  if (slot == kMissing && atomicCAS(&demand.slotOf[brick], kMissing, kAsked) == kMissing)
    demand.bricks[atomicAdd(&demand.counts->bricks, 1u)] = brick;
}

/// Notes that a brick is read.
__device__ inline void stamp(const BrickDemand& demand, std::uint32_t slot) {
  if (demand.stamps != nullptr && demand.stamps[slot] != demand.now)
    demand.stamps[slot] = demand.now;
}

/// The pixel of a thread in a tile of the band.
struct TilePixel {
  int column, row, rowOfBand;

  __device__ TilePixel(const TileBand& band, std::uint32_t tile) {
    const int columns = TileBand::tilesAlong(band.resolution.width);
    rowOfBand = int(tile) / columns * kMarchTileSide + int(threadIdx.x) / kMarchTileSide;
    column = int(tile) % columns * kMarchTileSide + int(threadIdx.x) % kMarchTileSide;
    row = rowOfBand + band.firstTileRow * kMarchTileSide;
  }
  [[nodiscard]] __device__ bool within(const TileBand& band) const {
    return column < band.resolution.width && row < band.resolution.height;
  }
  __device__ void set(const TileBand& band, const PixelColor& c) const {
    band.pixels[place(band)] = make_float4(c.r, c.g, c.b, c.alpha);
  }
  [[nodiscard]] __device__ PixelColor get(const TileBand& band) const {
    const float4 c = band.pixels[place(band)];
    return {c.x, c.y, c.z, c.w};
  }

 private:
  [[nodiscard]] __device__ std::size_t place(const TileBand& band) const {
    return std::size_t(rowOfBand) * std::size_t(band.resolution.width) + std::size_t(column);
  }
};

/// Lists what a block works on if one of its rays waits.
/// \param count    number of all blocks whose rays wait
/// \param waiting  their list
__device__ inline void listIfWaiting(bool ended, std::uint32_t number, std::uint32_t* count,
                                     std::uint32_t* waiting) {
  const bool any = __syncthreads_or(ended ? 0 : 1) != 0;
  if (any && threadIdx.x == 0) waiting[atomicAdd(count, 1u)] = number;
}

/// The work of a block.
template <class Kept>
struct TileWork {
  std::uint32_t entry, tile;
  bool keeps;  ///< whether rays that wait are kept
  bool isNew;  ///< whether the rays begin

  __device__ explicit TileWork(const WaitingTiles<Kept>& w) {
    const bool isFirst = w.count == 0;
    entry = isFirst || w.begin ? blockIdx.x : w.entries[blockIdx.x];
    tile = isFirst ? entry : w.tiles[entry];
    keeps = !isFirst, isNew = isFirst || w.begin;
  }
  /// The number of the thread's ray among those that are kept.
  [[nodiscard]] __device__ std::size_t ray() const {
    return std::size_t(entry) * kMarchTilePixels + threadIdx.x;
  }
};

/// Goes on with the ray of a thread.
/// \param march   march(pixel, progress) adds samples. \return whether the ray has ended
/// \param finish  finish(progress) returns the color of a ray that has ended
/// \return whether the ray has ended
template <class Progress, class Kept, class March, class Finish>
__device__ bool goOn(const TileBand& band, const WaitingTiles<Kept>& w, const TileWork<Kept>& work,
                     March&& march, Finish&& finish) {
  const TilePixel pixel(band, work.tile);
  if (!pixel.within(band)) return true;
  Progress at;
  if (!work.isNew) {
    const Kept kept = w.rays[work.ray()];
    if (kept.next < 0) return true;
    at = kept.progress(pixel.get(band));
  }
  const bool ended = march(pixel, at);
  if (ended || work.keeps) pixel.set(band, ended ? finish(at) : channelsOf(at));
  if (work.keeps) w.rays[work.ray()] = ended ? Kept::ended() : Kept::of(at);
  return ended;
}

}  // namespace esvr::cuda
