#pragma once
/// A picture, or a band of it, as the kernels see it: tiles of pixels, and along their rays bins of
/// kBinSamples samples. Each tile has for each bin a list of the ellipsoids that may reach it.

#include <cuda_runtime_api.h>

#include <cstdint>

#include "field/voxel_rule.h"
#include "render/ray_box.h"
#include "render/sample_rule.h"
#include "render/seen_ellipsoid.h"
#include "render/window_form.h"

namespace esvr::cuda {

/// The numbers by which drawing on CUDA is tuned; none of them decides on more of a picture than
/// its rounding.
struct DrawTuning {
  static constexpr int kTileSide = 8;  ///< pixels
  static constexpr int kTilePixels = kTileSide * kTileSide;
  static constexpr int kGroups =
      4;  ///< groups of threads that share a tile's ellipsoids among them
  static constexpr int kDrawThreads = kTilePixels * kGroups;
  static constexpr int kBlocksPerMultiprocessor = 4;
  /// The size of a window of voxels: as much as a block of threads can have in shared memory.
  static constexpr int kWindowVoxels = 8192, kWindowSlabs = 64;
  static constexpr int kLanesOfForm = 8;  ///< threads that share an ellipsoid's voxels
  /// Fewer samples at once only where the window of a single ray is too large.
  static constexpr int kFewSamples = 8;
  static constexpr int kListThreads = 128;
  /// An ellipsoid in more lists than this is listed by a whole warp.
  static constexpr int kManyLists = 24;
  static constexpr int kListBlocksPerMultiprocessor = 8;
  /// Work begins with the tiles of the longest lists; their lengths are told apart by powers of 2.
  static constexpr int kLengthClasses = 12;
  static constexpr int kMaxParts = 16;  ///< into which the depth is divided at most
};

/// The place of an ellipsoid in the picture.
struct Footprint {
  double column, row;                                       ///< its outline's middle
  float xx, xy, yy;                                         ///< its outline, slightly widened
  float nearest, farthest;                                  ///< along forward, slightly widened
  std::int16_t firstColumn, lastColumn, firstRow, lastRow;  ///< firstRow > lastRow: not seen
  std::int32_t everywhere;
};

struct TileFrame {
  View view;
  Resolution resolution;
  double step;
  int tileColumns, firstTileRow, tileRows;  ///< the band's
  std::int64_t firstBin;                    ///< counted from the eye
  int bins;
  int parts;       ///< parts of the depth that are drawn at once
  int binsOfPart;  ///< the last part may have less
  Between between;

  [[nodiscard]] ESVR_HD int tiles() const { return tileColumns * tileRows; }
};

/// A part of a tile.
struct TilePart {
  std::uint32_t tile, part;
};

/// Counters of a frame while it is drawn.
struct FrameCounters {
  unsigned long long pairs;                         ///< entries of all lists
  std::uint32_t items[DrawTuning::kLengthClasses];  ///< parts of tiles that have lists
  std::uint32_t results;  ///< results of parts, in tiles that have several
  std::uint32_t occupiedTiles;
  std::uint32_t longestTile;  ///< entries of a tile's lists, at most
  std::uint32_t longestBin;
  std::uint32_t next;   ///< item to draw
  std::uint32_t large;  ///< ellipsoids in many lists
};

/// Device memory, borrowed.
struct TileLists {
  FrameCounters* counters;
  std::uint32_t* counts;   ///< bins a tile: how long its list is
  std::uint32_t* ends;     ///< bins a tile: where its list ends, once it is filled
  std::uint32_t* entries;  ///< numbers of ellipsoids
  std::uint32_t* sorted;   ///< room to sort long lists
  std::uint64_t entryCapacity, sortedCapacity;
  TilePart* items;             ///< tiles * parts for each class of lengths
  std::uint32_t* partsOfTile;  ///< that have lists
  std::uint32_t* partsDone;    ///< tiles
  std::uint32_t* closedAt;     ///< tiles: a part behind which nothing is seen
  std::uint32_t* resultOf;     ///< parts a tile: place of a result
  RayState* results;           ///< kTilePixels each
  std::uint64_t resultCapacity;
};

inline constexpr std::uint32_t kNoResult = 0xffffffffu;

/// Only sums in float32 have an order, and only lists longer than a block are sorted in memory;
/// there they lie where their entries do.
ESVR_HD inline bool needSorting(const FrameCounters& c, Between between) {
  return between == Between::kSum && c.longestBin > std::uint32_t(DrawTuning::kDrawThreads);
}
/// Whether the room is enough for what a frame counted.
ESVR_HD inline bool listsFit(const FrameCounters& c, const TileLists& lists, Between between) {
  return c.pairs <= lists.entryCapacity && c.results <= lists.resultCapacity &&
         (!needSorting(c, between) || c.pairs <= lists.sortedCapacity);
}

struct DeviceEllipsoids {
  const PackedEllipsoid* ellipsoids;
  std::uint32_t count;
  const Vec3* origins;       ///< the chunks' origins
  const RayKernel* kernels;  ///< one, or an ellipsoid's each
  std::int32_t ownKernels;
};

/// Ellipsoids seen by a frame.
struct SeenEllipsoids {
  EllipsoidView* views;  ///< for Between::kSum
  Footprint* footprints;
  std::uint32_t* large;  ///< numbers of those in many lists, in any order
};

/// Looks at the ellipsoids and counts the entries of lists. `lists.counts` and the counters are
/// zero before.
/// \param multiprocessors  of the device
void launchView(const TileFrame& frame, const DeviceEllipsoids& ellipsoids,
                const SeenEllipsoids& seen, const TileLists& lists, int multiprocessors,
                cudaStream_t stream);
/// Finds room for each list and orders the work.
void launchPlan(const TileFrame& frame, const TileLists& lists, cudaStream_t stream);
/// Does nothing where entries exceed the capacity.
void launchFill(const TileFrame& frame, std::uint32_t count, const SeenEllipsoids& seen,
                const TileLists& lists, int multiprocessors, cudaStream_t stream);

/// The arguments of drawing that do not depend on what is between voxels.
struct SamplingArguments {
  TileFrame frame;
  TileLists lists;
  SampleRule rule;
  ClipBox clip;
  float4* pixels;  ///< the band's, row after row: red, green, blue, alpha
};

struct SumArguments {
  SamplingArguments draw;
  const EllipsoidView* views;
  const Footprint* footprints;
};

struct VoxelArguments {
  SamplingArguments draw;
  const WindowForm* forms;
  const Footprint* footprints;
  const Vec3* origins;  ///< the chunks' origins
  float bound;          ///< no intensity is larger; sums are exact in a fixed fraction of it
  VoxelRule rule;
};

/// Both do nothing where the lists did not fit. \param multiprocessors  of the device
void launchDrawSums(const SumArguments& arguments, int multiprocessors, cudaStream_t stream);
void launchDrawVoxels(const VoxelArguments& arguments, int multiprocessors, cudaStream_t stream);

}  // namespace esvr::cuda
