#pragma once
/// Drawing on the CPU: the functions behind the renderers of esvr/render.h, and the voxels that
/// they keep from picture to picture.

#include <array>
#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "core/brick_index.h"
#include "esvr/field.h"
#include "esvr/render.h"
#include "field/evaluate.h"
#include "field/voxel_rule.h"
#include "render/cell_bricks.h"
#include "render/picture.h"

namespace esvr {

// The voxels of a field, which are decoded when a ray reads them.

/// Arrays of kSize floats that are made when they are first read. If several threads make one at
/// the same time, they make the same values, and one of them is kept.
template <std::size_t kSize>
class LazyArrays {
 public:
  using Values = std::array<float, kSize>;

  explicit LazyArrays(std::size_t count) : arrays_(count) {}
  LazyArrays(const LazyArrays&) = delete;
  LazyArrays& operator=(const LazyArrays&) = delete;
  ~LazyArrays() { forget(); }

  /// \param make  make(values) fills an array. \return false if it need not be kept
  /// \return the array, or null if it was not kept
  template <class Make>
  const float* get(std::size_t number, Make&& make) const {
    const Values* there = arrays_[number].load(std::memory_order_acquire);
    if (there == nullptr) there = put(number, make);
    return there == &vacant() ? nullptr : there->data();
  }
  /// Frees all arrays; no thread may read at the same time.
  void forget() {
    for (auto& array : arrays_)
      if (const Values* const there = array.exchange(nullptr); there != &vacant()) delete there;
  }

 private:
  static const Values& vacant() {
    static const Values values{};
    return values;
  }
  template <class Make>
  const Values* put(std::size_t number, Make&& make) const {
    auto made = std::make_unique<Values>();
    const bool kept = make(std::span<float, kSize>(*made));
    const Values* expected = nullptr;
    const Values* const wanted = kept ? made.get() : &vacant();
    if (!arrays_[number].compare_exchange_strong(expected, wanted, std::memory_order_acq_rel))
      return expected;
    if (kept) (void)made.release();
    return wanted;
  }

  mutable std::vector<std::atomic<const Values*>> arrays_;
};

/// The sums of one level of a field, on all bricks that may have a voxel other than the background.
class LevelSums {
 public:
  /// \param inLevel  the field in voxels of the level
  /// \param rule     by which its sums become voxels; its bricks and masks must outlive the object
  /// \param box      no voxel of level 0 outside it is active
  /// \throws MemoryExceeded  as for reachedBricks
  LevelSums(const Field& inLevel, const RevoxeliseOptions& rule, const Box& box, int level);

  [[nodiscard]] const std::vector<Coord>& corners() const { return corners_; }
  /// The voxels of a brick. \return false if all are the background
  bool decode(std::uint32_t number, std::span<float, kBrickVoxels> values) const;

 private:
  void mixWithBox(Coord corner, std::span<float, kBrickVoxels> values) const;

  int level_;
  Box box_;
  RevoxeliseOptions voxels_;
  VoxelRule rule_;
  PreparedField field_;
  std::vector<Coord> corners_;  ///< index corners of the bricks of voxels, in voxels of the level
  BrickEvaluator evaluator_;
};

/// The bricks of cells of a field. Any number of threads can read at the same time. Coarser levels are sums
/// of wider ellipsoids (field/coarser_field.h), for which no finer level is made; where
/// hasCoarserFields() says no, they are means of the next finer one.
class LazyCells {
 public:
  /// \param field   must outlive the object
  /// \param voxels  rule by which sums become voxels; its bricks and masks must outlive the object. If
  ///                its bricks are restricted, voxels elsewhere are the background
  LazyCells(const Field& field, const RevoxeliseOptions& voxels);

  [[nodiscard]] float background() const { return field_.background; }
  /// Makes these levels of detail; no thread may read at the same time.
  /// \throws MemoryExceeded  as for reachedBricks
  /// \throws UsageError      as for makeBrickTable
  void prepare(int first, int last);
  /// A box around the cells of level 0, in index space, that is found without them; nothing if coarser
  /// levels need level 0, or there is no ellipsoid in the box of the voxels.
  [[nodiscard]] const std::optional<PlaceBox>& roughBox() const { return roughBox_; }
  [[nodiscard]] bool isPrepared(int level) const { return bool(levels_[std::size_t(level)]); }
  /// The bricks of a level that was prepared.
  [[nodiscard]] const BrickTable& table(int level) const {
    return levels_[std::size_t(level)]->table;
  }
  /// The voxels of a brick of cells, or null if all of them are the background.
  [[nodiscard]] const float* values(std::uint32_t brick) const;
  void forget();

 private:
  struct Level {
    /// \param bricks  bricks of voxels of the level
    Level(std::span<const Coord> bricks, std::uint32_t firstCells);

    BrickIndex index;  ///< of the bricks of voxels
    BrickTable table;
    LazyArrays<kBrickVoxels> voxels;
    LazyArrays<kCellBrickVoxels> cells;
    std::unique_ptr<const LevelSums> sums;  ///< null: voxels are means of the next finer level
  };

  void make(int level);
  [[nodiscard]] const float* voxelsOf(int level, Coord brick) const;
  bool average(int level, Coord brick, std::span<float, kBrickVoxels> values) const;

  const Field& field_;
  RevoxeliseOptions voxels_;
  bool coarserAreSums_;
  std::optional<PlaceBox> roughBox_;
  std::array<std::unique_ptr<Level>, kLevels> levels_;
  std::vector<int> made_;  ///< the levels in the order of the numbers of their bricks
};

/// The bricks of LazyCells for marchBricks().
struct LazySlots {
  const LazyCells& cells;

  [[nodiscard]] std::uint32_t slot(std::uint32_t brick) const {
    return cells.values(brick) == nullptr ? BrickSlotsView::kVacant : brick;
  }
  [[nodiscard]] static bool hasSlot(std::uint32_t slot) { return BrickSlotsView::hasSlot(slot); }
  [[nodiscard]] const float* values(std::uint32_t slot) const { return cells.values(slot); }
};

/// Draws the picture of renderField() with Between::kVoxels.
/// \throws UsageError, Cancelled  as for renderField
[[nodiscard]] Image renderCells(LazyCells& cells, const RenderOptions& options);

// A volume and its coarser levels.

/// Draws as renderVolume, with the same exceptions.
[[nodiscard]] Image renderLevels(VolumeLevels& levels, const RenderOptions& options);

// Several grids in one picture.

/// The bricks of a field or of a volume for marchGrids().
struct GridSlots {
  const LazyCells* field;  ///< null: those of a volume
  BrickSlotsView volume;

  [[nodiscard]] std::uint32_t slot(std::uint32_t brick) const {
    return field == nullptr ? volume.slot(brick) : LazySlots{*field}.slot(brick);
  }
  [[nodiscard]] static bool hasSlot(std::uint32_t slot) { return BrickSlotsView::hasSlot(slot); }
  [[nodiscard]] const float* values(std::uint32_t slot) const {
    return field == nullptr ? volume.values(slot) : field->values(slot);
  }
};

/// The cells of a grid. Those of a field are decoded when a ray reads them.
class GridCells {
 public:
  /// \throws  as for LazyCells::prepare and makeBrickAtlas
  explicit GridCells(const DrawnGrid& grid);

  [[nodiscard]] float background() const { return background_; }
  [[nodiscard]] const BrickTable& table() const { return field_ ? field_->table(0) : atlas_.table; }
  [[nodiscard]] GridSlots slots() const { return {field_.get(), {nullptr, pages_.data()}}; }
  void forget() {
    if (field_) field_->forget();
  }

 private:
  std::unique_ptr<LazyCells> field_;  ///< null: the grid is a volume
  BrickAtlas atlas_;
  std::vector<const float*> pages_;
  float background_;
};

/// Draws a picture of makeGridsRenderer().
/// \throws UsageError  as for Renderer::draw() of several grids
/// \throws Cancelled   RenderOptions::cancel was set
[[nodiscard]] Image renderGrids(const std::vector<GridCells>& grids, const RenderOptions& options);

// The tiles of a picture of bricks.

/// For each tile of a picture, the range of samples in which its rays may meet bricks of cells.
class TileRanges {
 public:
  static constexpr int kSide = 8;  ///< pixels of a tile

  struct Samples {
    int first, last;  ///< counted from CoverView::firstSample; none if last < first
  };

  /// The rays meet no bricks.
  explicit TileRanges(Resolution resolution);
  /// Widens the ranges by those of further bricks.
  /// \param view    has the resolution of all other views; its first sample is the same too
  /// \param bricks  places in bricks, in the frame of the view
  void add(const CoverView& view, const std::vector<Coord>& bricks);

  /// Sets the pixels of the tiles whose rays may meet bricks, tile by tile in parallel.
  /// \param colorOf  colorOf(column, row, samples) returns the color of a pixel; `samples` are those of
  ///                 its tile
  /// \throws Cancelled  RenderOptions::cancel was set
  void draw(const RenderOptions& options, Picture& picture,
            const std::function<PixelColor(int, int, const Samples&)>& colorOf) const;

 private:
  Resolution resolution_;
  int columns_, rows_;  ///< tiles
  std::vector<Samples> ranges_;
};

}  // namespace esvr
