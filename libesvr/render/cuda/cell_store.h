#pragma once
/// The bricks of cells that a CUDA renderer marches through, with their levels of detail. Those of
/// a volume are all in device memory. Those of a field are decoded when a ray asks for them, and
/// dropped when memory is short.

#include <cuda_runtime_api.h>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/cuda/device_buffer.h"
#include "esvr/field.h"
#include "esvr/volume.h"
#include "field/line_form.h"
#include "field/voxel_rule.h"
#include "render/cell_bricks.h"

namespace esvr::cuda {

/// The bricks of cells of a level of detail in device memory.
class DeviceLevel {
 public:
  DeviceLevel(const BrickTable& table, cudaStream_t stream)
      : origin_(table.origin),
        blocks_(table.blocks),
        box_(cellsOf(table)),
        first_(table.first),
        blockOf_(table.blockOf, stream),
        rows_(table.rows, stream),
        bricks_(table.bricks, stream) {}

  [[nodiscard]] BrickTableView table() const {
    return {origin_, blocks_, blockOf_.data(), rows_.data()};
  }
  [[nodiscard]] const PlaceBox& box() const { return box_; }
  [[nodiscard]] std::uint32_t first() const { return first_; }  ///< number of the first brick
  [[nodiscard]] std::uint32_t count() const { return std::uint32_t(bricks_.size()); }
  /// By brick from the first one: its place relative to the table's origin, in bricks.
  [[nodiscard]] const Coord* bricks() const { return bricks_.data(); }
  [[nodiscard]] std::size_t bytes() const {
    return blockOf_.bytes() + rows_.bytes() + bricks_.bytes();
  }

 private:
  Coord origin_, blocks_;
  PlaceBox box_;
  std::uint32_t first_;
  DeviceBuffer<std::uint32_t> blockOf_;
  DeviceBuffer<BrickRow> rows_;
  DeviceBuffer<Coord> bricks_;
};

// Fields: their bricks, and the ellipsoids that reach each of them.

/// An ellipsoid as the decoder reads it.
struct alignas(16) CellForm {
  LineForm form;        ///< center relative to the origin of its chunk
  float halfZ;          ///< half width of the support's bounding box along z
  std::uint32_t chunk;  ///< number of its chunk
};

/// A field, or a coarser level of one, as bricks of cells that can be decoded one by one.
struct CellField {
  BrickTable table;                             ///< bricks that supports reach
  std::vector<CellForm> forms;                  ///< by ellipsoid
  std::vector<KernelConstants<float>> kernels;  ///< one for all, or one for each ellipsoid
  std::vector<Coord> origins;                   ///< origins of the chunks
  std::vector<std::uint32_t> begin;             ///< by brick: its entries are [b] to [b + 1] - 1
  std::vector<std::uint32_t> ellipsoid;         ///< by entry
  /// By brick: bit c is set if voxels in the brick of corner c (core/geometry.h) may differ from
  /// the background. Empty: all may.
  std::vector<std::uint8_t> corners;
  /// The masks by which voxels are active, and for each brick and corner the number of that of the
  /// voxels there, or BrickIndex::kNone. Otherwise empty.
  std::vector<BrickMask> masks;
  std::vector<std::uint32_t> maskOf;
  Box box;                          ///< no voxel outside it is active
  std::vector<Coord> alwaysActive;  ///< voxels that are active whatever their values
  VoxelRule rule;
  int level = 0;  ///< voxels are 2^level times as long as those of the grid
  Box boxOfGrid;  ///< the box in voxels of level 0
};

/// \param voxels  rule by which sums become voxels. If its bricks are restricted, voxels elsewhere
///                are the background
/// \throws MemoryExceeded  as for reachedBricks
/// \throws RuntimeFailure  there are 2^32 pairs of ellipsoids and bricks or more
/// \throws UsageError      as for makeBrickTable
[[nodiscard]] CellField makeCellField(const Field& field, const RevoxeliseOptions& voxels);

/// A coarser level whose voxels are sums (field/coarser_field.h).
/// \param voxels      as above; hasCoarserFields()
/// \param firstBrick  number of its first brick
[[nodiscard]] CellField makeCoarserCellField(const Field& field, const RevoxeliseOptions& voxels,
                                             int level, std::uint32_t firstBrick);

/// The bricks of a DeviceLevel, as kernels read them.
struct LevelBricks {
  Coord origin;         ///< first voxel of the table, in voxels of the level
  std::uint32_t first;  ///< number of the level's first brick
  std::uint32_t count;
  const Coord* bricks;
};

/// A CellField on the device.
struct CellFieldView {
  BrickTableView table;  ///< of level 0
  LevelBricks levels[kLevels];
  int level;  ///< level of the CellField, to which all that follows belongs
  const CellForm* forms;
  const KernelConstants<float>* kernels;
  std::uint32_t kernelStride;  ///< 0: one kernel for all ellipsoids; 1: one for each
  const Coord* origins;
  const std::uint32_t *begin, *ellipsoid;  ///< by brick from the level's first one
  const std::uint8_t* corners;             ///< null: all voxels may differ from the background
  /// Masks of active voxels; null: there are none. Their numbers by brick and corner, or kNoMask.
  static constexpr std::uint32_t kNoMask = 0xffffffffu;
  const BrickMask* masks;
  const std::uint32_t* maskOf;
  Box box;                    ///< no voxel outside it is active
  const Coord* alwaysActive;  ///< voxels that are active whatever their values
  std::uint32_t alwaysActiveCount;
  VoxelRule rule;
  Box boxOfGrid;  ///< the box in voxels of level 0
};

/// The ellipsoids of a CellField in device memory.
class DeviceSums {
 public:
  DeviceSums(const CellField& field, cudaStream_t stream);

  /// Sets all of a view but its tables.
  void describe(CellFieldView& view) const;
  [[nodiscard]] float background() const { return rule_.background; }
  [[nodiscard]] std::size_t bytes() const;

 private:
  VoxelRule rule_;
  int level_;
  Box box_, boxOfGrid_;
  DeviceBuffer<CellForm> forms_;
  DeviceBuffer<KernelConstants<float>> kernels_;
  DeviceBuffer<Coord> origins_;
  DeviceBuffer<std::uint32_t> begin_, ellipsoid_;
  DeviceBuffer<std::uint8_t> corners_;
  DeviceBuffer<BrickMask> masks_;
  DeviceBuffer<std::uint32_t> maskOf_;
  DeviceBuffer<Coord> alwaysActive_;
};

/// The levels of detail of a field in device memory. The coarser ones either have sums of their own, or
/// are means of level 0.
class DeviceCells {
 public:
  DeviceCells(const CellField& field, cudaStream_t stream);

  /// Adds the next coarser level, whose first brick has the number brickCount(), as means.
  void add(DeviceLevel level) { levels_.push_back(std::move(level)); }
  /// The same with its sums; all coarser levels have them, or none.
  void add(const CellField& coarser, cudaStream_t stream);

  /// \param level  the one whose bricks are decoded
  [[nodiscard]] CellFieldView view(int level) const;
  [[nodiscard]] const DeviceLevel& level(int level) const { return levels_[std::size_t(level)]; }
  [[nodiscard]] int levelCount() const { return int(levels_.size()); }
  /// The number of bricks of all levels.
  [[nodiscard]] std::uint32_t brickCount() const {
    return levels_.back().first() + levels_.back().count();
  }
  [[nodiscard]] float background() const { return sums_.front().background(); }
  [[nodiscard]] std::size_t bytes() const;

 private:
  std::vector<DeviceLevel> levels_;
  std::vector<DeviceSums> sums_;  ///< sums of level 0 alone, or of all levels
};

struct DecodeArguments {
  CellFieldView field;
  const std::uint32_t* bricks;  ///< bricks to decode
  std::uint32_t count;
  const std::uint32_t* lastSlot;  ///< brick n gets the slot that lies n places before this one
  float* const* pages;            ///< see BrickSlotsView
  std::uint8_t* occupied;  ///< output, by brick: 1 if a voxel is not the background; must be 0
};

/// Decodes those of the bricks that belong to a level. Each voxel is summed in integers, as in a
/// fit, so that a brick has the same bits whenever it is decoded and whatever is decoded with it.
/// Bricks of a coarser level without sums of its own hold means of the voxels of level 0.
/// \param arguments  its field is DeviceCells::view() of the level
void launchDecode(const DecodeArguments& arguments, int level, cudaStream_t stream);

// The cache of decoded bricks.

/// The bricks that rays ask for. All pointers are to device memory.
struct BrickDemand {
  struct Counts {
    std::uint32_t bricks;   ///< bricks that are asked for
    std::uint32_t waiting;  ///< tiles with rays that wait
    std::uint32_t free;     ///< free slots
    std::uint32_t spare;    ///< slots that became free while bricks are decoded
  };
  Counts* counts;
  std::uint32_t* slotOf;  ///< see BrickSlotsView; null: no brick can be missing
  std::uint32_t* bricks;  ///< output: bricks that are asked for; room for all
  std::uint32_t* stamps;  ///< output: `now`, for each slot that a ray reads; null: not wanted
  std::uint32_t now;
  int ahead;  ///< missing bricks that a ray asks for besides the one at which it waits
};

/// Owner of a slot (BrickSlotsView) that is free.
inline constexpr std::uint32_t kNoOwner = 0xffffffffu;

/// Chooses the slots that bricks leave when memory is short: those that have not been read for the
/// longest time.
/// \param count   number of slots to choose; all that have an owner if there are fewer
/// \param owners  by slot: its brick, or kNoOwner
/// \param stamps  by slot: time of the last reading
[[nodiscard]] std::vector<std::uint32_t> oldestSlots(std::size_t count,
                                                     std::span<const std::uint32_t> owners,
                                                     std::span<const std::uint32_t> stamps);

struct SlotAccount;

class BrickCache {
 public:
  /// Bytes of a page and of its slots in the tables, of which GrowingBuffer keeps a quarter to
  /// spare.
  static constexpr std::size_t kPageBytes =
      BrickSlotsView::kPageFloats * sizeof(float) +
      BrickSlotsView::kPageSlots * (4 * sizeof(std::uint32_t) + sizeof(std::uint8_t)) * 5 / 4;

  /// \param cells  must outlive the cache
  BrickCache(const DeviceCells& cells, cudaStream_t stream);

  /// Takes account of all bricks of the cells, after levels were added. All are forgotten.
  void number();
  /// Limits the memory of the voxels from now on; at least one page is kept.
  void limit(std::uint64_t bytes) { maxBytes_ = bytes; }

  [[nodiscard]] BrickSlotsView slots() const { return {slotOf_.data(), pageTable_.data()}; }
  /// What rays write to ask for bricks. A call begins a new time, so that bricks which are read
  /// later are dropped later.
  /// \param pass  how often the rays of the picture have waited
  [[nodiscard]] BrickDemand demand(int pass);
  [[nodiscard]] BrickDemand::Counts counts();
  /// Whether there was no room for all bricks that rays asked for last. In the next pass, a ray
  /// then asks for no brick but the one at which it waits.
  [[nodiscard]] bool isCrowded() const { return crowded_; }
  /// The number of bricks for which there is room now.
  [[nodiscard]] std::uint32_t slotCount() const {
    return std::uint32_t(pages_.size()) * BrickSlotsView::kPageSlots;
  }
  /// Forgets all bricks. The memory stays.
  void forget();
  /// Decodes the bricks that rays have asked for, as many as there is room for; the others become
  /// missing again.
  /// \param levels  those of the bricks
  /// \throws DeviceMemoryError  there is no memory for a single page
  void serve(const BrickDemand::Counts& counts, const LevelBounds& levels);

  [[nodiscard]] std::size_t bytes() const;
  /// The smallest number of bytes with which it works.
  [[nodiscard]] std::size_t fixedBytes() const {
    return slotOf_.bytes() + asked_.bytes() + kPageBytes;
  }

 private:
  [[nodiscard]] SlotAccount account();
  [[nodiscard]] std::uint32_t makeRoomFor(std::uint32_t bricks, std::uint32_t free);
  [[nodiscard]] bool addPage(std::uint32_t free);
  [[nodiscard]] std::uint32_t evict(std::uint32_t bricks, std::uint32_t free);
  void decode(std::uint32_t bricks, std::uint32_t free, const LevelBounds& levels);

  const DeviceCells& cells_;
  cudaStream_t stream_;
  std::uint64_t maxBytes_ = 0;  ///< 0: no limit
  bool crowded_ = false;
  std::uint32_t now_ = 0;
  std::vector<DeviceBuffer<float>> pages_;
  GrowingBuffer<float*> pageTable_;
  DeviceBuffer<std::uint32_t> slotOf_, asked_;
  GrowingBuffer<std::uint32_t> owners_, stamps_, free_, spare_;
  GrowingBuffer<std::uint8_t> occupied_;
  DeviceBuffer<BrickDemand::Counts> counts_;
  Pinned<BrickDemand::Counts> downloaded_;
};

// Any of the two.

class CellStore {
 public:
  CellStore() = default;
  CellStore(const CellStore&) = delete;
  CellStore& operator=(const CellStore&) = delete;
  virtual ~CellStore() = default;

  [[nodiscard]] virtual float background() const = 0;
  /// A box around all cells of level 0, in index space.
  [[nodiscard]] PlaceBox box() const {
    const DeviceLevel& cells = level(0);
    const Vec3 from = pointOf(cells.table().origin);
    return {sum(cells.box().low, from), sum(cells.box().high, from)};
  }
  /// Makes the levels that a picture needs.
  virtual void prepare(const LevelBounds& bounds) = 0;
  /// A level that was prepared.
  [[nodiscard]] virtual const DeviceLevel& level(int level) const = 0;
  [[nodiscard]] virtual BrickSlotsView slots() const = 0;
  /// Decodes bricks when rays ask for them; null if all bricks are there.
  [[nodiscard]] virtual BrickCache* cache() { return nullptr; }
  [[nodiscard]] virtual std::size_t bytes() const = 0;
};

/// The voxels of a field, which are decoded when a ray asks for them.
/// \throws RuntimeFailure, UsageError  as for makeCellField
[[nodiscard]] std::unique_ptr<CellStore> storeOf(const Field& field,
                                                 const RevoxeliseOptions& voxels,
                                                 cudaStream_t stream);
/// The voxels of a volume, which must outlive the store.
[[nodiscard]] std::unique_ptr<CellStore> storeOf(const SparseVolume& volume, cudaStream_t stream);

}  // namespace esvr::cuda
