#pragma once
/// What the kernels have in common that march the rays of a tile. Each block draws one tile and each
/// thread one ray. The rays of a warp are 8 x 4 neighbours.

#include "render/cuda/brick_demand.h"
#include "render/cuda/waiting_tiles.h"
#include "render/segment_table.h"

namespace esvr::cuda {

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
