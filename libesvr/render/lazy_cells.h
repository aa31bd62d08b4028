#pragma once
/// Bricks of cells (brick_march.h) on the CPU that are decoded from a field when a ray reads them.
/// Any number of threads can read at the same time.

#include <array>
#include <atomic>
#include <memory>
#include <vector>

#include "core/brick_index.h"
#include "esvr/field.h"
#include "field/brick_evaluator.h"
#include "field/voxel_rule.h"
#include "render/brick_table.h"

namespace esvr {

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

class LazyCells {
 public:
  /// \param field   must outlive the object
  /// \param voxels  rule by which sums become voxels; its bricks and masks must outlive the object. If
  ///                its bricks are restricted, voxels elsewhere are the background
  /// \throws MemoryExceeded  as for reachedBricks
  /// \throws UsageError      as for makeBrickTable
  LazyCells(const Field& field, const RevoxeliseOptions& voxels);

  [[nodiscard]] float background() const { return rule_.background; }
  /// Makes levels of detail up to this one; no thread may read at the same time.
  /// \throws UsageError  as for makeBrickTable
  void prepare(int lastLevel);
  /// The bricks of level 0, or of a level that was prepared.
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
  };

  [[nodiscard]] int levelOf(std::uint32_t brick) const;
  [[nodiscard]] const float* voxelsOf(int level, Coord brick) const;
  bool decode(std::uint32_t number, std::span<float, kBrickVoxels> values) const;
  bool average(int level, Coord brick, std::span<float, kBrickVoxels> values) const;
  [[nodiscard]] bool fill(int level, std::size_t brick,
                          std::span<float, kCellBrickVoxels> values) const;

  PreparedField field_;
  RevoxeliseOptions voxels_;
  VoxelRule rule_;
  std::vector<Coord> corners_;  ///< index corners of the bricks of voxels of level 0
  BrickEvaluator evaluator_;
  std::vector<std::unique_ptr<Level>> levels_;
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

}  // namespace esvr
