#pragma once
/// The data of a picture of a sum of ellipsoids, or of a band of it, that the CUDA kernels share.
/// The picture is divided into tiles of 8 x 8 pixels, and the rays of a tile into bins of
/// kBinSamples samples. For each tile and bin there is a list of the ellipsoids that may reach it.
/// sum_renderer.cu makes the lists, and draw_sums.cu draws them.

#include <cuda_runtime_api.h>

#include <cstdint>

#include "field/voxel_rule.h"
#include "render/ellipsoid_view.h"
#include "render/sample_rule.h"

namespace esvr::cuda {

/// Sizes that were chosen for speed. They affect a picture by rounding only.
struct DrawTuning {
  static constexpr int kTileSide = 8;  ///< pixels
  static constexpr int kTilePixels = kTileSide * kTileSide;
  static constexpr int kGroups = 4;  ///< groups of threads that draw a tile together
  static constexpr int kDrawThreads = kTilePixels * kGroups;
  static constexpr int kBlocksPerMultiprocessor = 4;
  static constexpr int kListThreads = 128;
  /// An ellipsoid that may be in more lists than this is listed by a whole warp.
  static constexpr int kManyLists = 24;
  static constexpr int kListBlocksPerMultiprocessor = 8;
  /// Work begins with the parts of tiles that have the longest lists. They are sorted into classes
  /// of lengths, each a factor of 2.
  static constexpr int kLengthClasses = 12;
};

/// The outline of an ellipsoid's support in the picture, and its range of depths. Both are slightly
/// widened, because they are rounded to float32. See ScreenEllipse and ScreenBounds.
struct Footprint {
  double column, row;
  float xx, xy, yy;
  float nearest, farthest;
  std::int16_t firstColumn, lastColumn, firstRow, lastRow;  ///< firstRow > lastRow: not visible
  std::int32_t everywhere;
};

struct TileFrame {
  View view;
  Resolution resolution;
  double step;
  int tileColumns, firstTileRow, tileRows;  ///< tiles of the band
  std::int64_t firstBin;                    ///< counted from the eye
  int bins;
  int parts;       ///< parts of the depth that are drawn in parallel
  int binsOfPart;  ///< the last part may have fewer bins

  [[nodiscard]] ESVR_HD int tiles() const { return tileColumns * tileRows; }
};

/// A range of a tile's depth, which one block of threads draws.
struct TilePart {
  std::uint32_t tile, part;
};

/// Counters of one frame.
struct FrameCounters {
  unsigned long long entries;                       ///< entries of all lists
  std::uint32_t items[DrawTuning::kLengthClasses];  ///< parts of tiles with entries, by class
  std::uint32_t results;  ///< parts whose results are stored because their tile has several parts
  std::uint32_t occupiedTiles;  ///< tiles with entries
  std::uint32_t longestTile;    ///< entries of all lists of a tile, maximum over the tiles
  std::uint32_t longestBin;     ///< entries of one list, maximum over the lists
  std::uint32_t next;           ///< number of the next item to draw
  std::uint32_t large;          ///< ellipsoids in many lists
};

/// Pointers to the device memory of the lists and of the work queue.
struct TileLists {
  FrameCounters* counters;
  std::uint32_t* counts;   ///< by tile and bin: length of the list
  std::uint32_t* ends;     ///< by tile and bin: end of the list in `entries`, once it is filled
  std::uint32_t* entries;  ///< numbers of ellipsoids
  std::uint32_t* sorted;   ///< entries of long lists after sorting
  std::uint64_t entryCapacity, sortedCapacity;
  TilePart* items;             ///< the queue: room for all parts of all tiles in each class
  std::uint32_t* partsOfTile;  ///< by tile: number of parts that have entries
  std::uint32_t* partsDone;    ///< by tile: number of parts that are drawn
  std::uint32_t* closedAt;     ///< by tile: foremost part known to be opaque on all rays
  std::uint32_t* resultOf;     ///< by tile and part: number of its result, or kNoResult
  RayState* results;           ///< kTilePixels for each result
  std::uint64_t resultCapacity;
};

inline constexpr std::uint32_t kNoResult = 0xffffffffu;

/// True if lists are sorted in global memory. They need sorting, because the sum of floats depends
/// on the order. Lists of at most kDrawThreads entries are sorted in shared memory instead.
ESVR_HD inline bool needSorting(const FrameCounters& c) {
  return c.longestBin > std::uint32_t(DrawTuning::kDrawThreads);
}
/// True if the buffers are large enough for the entries and results that a frame counted.
ESVR_HD inline bool listsFit(const FrameCounters& c, const TileLists& lists) {
  return c.entries <= lists.entryCapacity && c.results <= lists.resultCapacity &&
         (!needSorting(c) || c.entries <= lists.sortedCapacity);
}

/// The arguments of drawing.
struct SumArguments {
  TileFrame frame;
  TileLists lists;
  SampleRule rule;
  VoxelRule voxelRule;  ///< clamps the sums
  ClipBox clip;
  const EllipsoidView* views;
  const Footprint* footprints;
  float4* pixels;  ///< pixels of the band, row after row: red, green, blue, alpha
};

/// Draws the picture. It does nothing if the lists did not fit.
/// \param multiprocessors  number of multiprocessors of the device
void launchDrawSums(const SumArguments& arguments, int multiprocessors, cudaStream_t stream);

}  // namespace esvr::cuda
