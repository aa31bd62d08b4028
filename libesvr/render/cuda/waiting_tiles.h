#pragma once
/// The tiles of a band whose rays wait for bricks.

#include <cstdint>

#include "core/cuda/growing_buffer.h"
#include "render/cuda/tile_band.h"
#include "render/kept_ray.h"

namespace esvr::cuda {

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

/// Their memory, which grows with their number. The list of entries is a stack: a pass takes entries
/// from its end, and those that wait again return to it.
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

}  // namespace esvr::cuda
