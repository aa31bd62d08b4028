#pragma once
/// Marches a ray through bricks of cells. A brick holds all voxels at the corners of its cells, so
/// that the interpolation of a sample reads one brick only. A ray crosses an empty brick, or an
/// empty block of bricks, in one step. A ray that meets a brick whose voxels are not there stops,
/// and can continue later. The code is compiled for host and device.

#include <bit>
#include <cstdint>

#include "render/march_scene.h"

namespace esvr {

/// A brick has 8 x 8 x 8 cells and stores the 9 x 9 x 9 voxels at their corners, z fastest.
inline constexpr int kCellBrickSide = kBrickSide + 1;
inline constexpr int kCellBrickVoxels = kCellBrickSide * kCellBrickSide * kCellBrickSide;
/// A brick is found through its block, which has 8 x 8 x 8 bricks.
inline constexpr int kBlockBricks = 8;
inline constexpr int kBlockSide = kBlockBricks * kBrickSide;  ///< voxels
inline constexpr int kBricksOfBlock = kBlockBricks * kBlockBricks * kBlockBricks;
inline constexpr std::uint32_t kNoCells = 0xffffffffu;

/// Bricks of a block that follow each other (z fastest).
struct alignas(16) BrickRow {
  static constexpr int kLength = 64;

  std::uint64_t there;  ///< bit i is set if brick i has a number
  std::uint32_t first;  ///< number of the first brick that has one; the others follow in order
};
inline constexpr int kRowsOfBlock = kBricksOfBlock / BrickRow::kLength;
static_assert(BrickRow::kLength == kBlockBricks * kBlockBricks, "a row has the bricks of one x");

/// Numbers the bricks of cells. Pointers are to host or device memory.
struct BrickTableView {
  Coord origin;                  ///< first voxel of the first block
  Coord blocks;                  ///< number of blocks along each axis
  const std::uint32_t* blockOf;  ///< number of each block, or kNoCells; z fastest
  const BrickRow* rows;          ///< kRowsOfBlock for each block
};

/// The voxels of bricks. They lie in slots, and the slots in pages.
struct BrickSlotsView {
  static constexpr int kPageLog2 = 8;
  static constexpr std::uint32_t kPageSlots = 1u << kPageLog2;
  static constexpr std::size_t kPageFloats = std::size_t(kPageSlots) * kCellBrickVoxels;
  /// Values of slotOf for bricks without a slot.
  static constexpr std::uint32_t kVacant = 0xffffffffu;   ///< all voxels are the background
  static constexpr std::uint32_t kMissing = 0xfffffffeu;  ///< the voxels are not there
  static constexpr std::uint32_t kAsked = 0xfffffffdu;    ///< as kMissing, and already asked for

  const std::uint32_t* slotOf;  ///< by brick; null: brick n has slot n
  const float* const* pages;    ///< kPageFloats values each

  /// Slot of a brick, or kVacant, kMissing or kAsked.
  [[nodiscard]] ESVR_HD std::uint32_t slot(std::uint32_t brick) const {
    return slotOf == nullptr ? brick : slotOf[brick];
  }
  [[nodiscard]] ESVR_HD static bool hasSlot(std::uint32_t slot) { return slot < kAsked; }
  [[nodiscard]] ESVR_HD const float* values(std::uint32_t slot) const {
    return pages[slot >> kPageLog2] + std::size_t(slot & (kPageSlots - 1)) * kCellBrickVoxels;
  }
};

namespace brick_march {

/// The brick that has a cell, or the empty cube around the cell: a brick or a whole block.
struct Found {
  std::uint32_t brick;  ///< kNoCells: empty
  Coord low;            ///< lowest corner of the brick or cube, a multiple of its side
  int side;             ///< a power of two

  [[nodiscard]] ESVR_HD bool contains(const Coord& cell) const {
    return (((cell.x ^ low.x) | (cell.y ^ low.y) | (cell.z ^ low.z)) & ~(side - 1)) == 0;
  }
};
/// An empty cube of one cell.
ESVR_HD inline Found nothingAt(const Coord& cell) { return {kNoCells, cell, 1}; }

ESVR_HD inline std::uint32_t countBits(std::uint64_t word) {
#ifdef __CUDA_ARCH__
  return std::uint32_t(__popcll(word));
#else
  return std::uint32_t(std::popcount(word));
#endif
}

/// The number of a brick of a row, or kNoCells.
ESVR_HD inline std::uint32_t numberIn(const BrickRow& row, int brick) {
  const std::uint64_t bit = std::uint64_t{1} << brick;
  return (row.there & bit) == 0 ? kNoCells : row.first + countBits(row.there & (bit - 1));
}

/// \param v  cell relative to the table's origin; it must lie within the blocks
ESVR_HD inline Found find(const BrickTableView& a, const Coord& v) {
  constexpr int kBlockLog2 = 6, kMask = kBlockBricks - 1;
  static_assert(kBlockSide == 1 << kBlockLog2);
  const Coord block{v.x >> kBlockLog2, v.y >> kBlockLog2, v.z >> kBlockLog2};
  const std::uint32_t number = a.blockOf[(block.x * a.blocks.y + block.y) * a.blocks.z + block.z];
  if (number == kNoCells)
    return {kNoCells,
            {block.x << kBlockLog2, block.y << kBlockLog2, block.z << kBlockLog2},
            kBlockSide};
  const Coord brick{v.x >> kBrickLog2, v.y >> kBrickLog2, v.z >> kBrickLog2};
  const BrickRow row = a.rows[number * kRowsOfBlock + std::uint32_t(brick.x & kMask)];
  return {numberIn(row, (brick.y & kMask) * kBlockBricks + (brick.z & kMask)),
          {brick.x << kBrickLog2, brick.y << kBrickLog2, brick.z << kBrickLog2},
          kBrickSide};
}

ESVR_HD inline float between(float a, float b, float s) { return a + s * (b - a); }

/// \param values  voxels of the brick
ESVR_HD inline float interpolate(const float* values, const FloatPlace& p, const Coord& cell) {
  constexpr int kMask = kBrickSide - 1, kX = kCellBrickSide * kCellBrickSide, kY = kCellBrickSide;
  const float* v = values + (cell.x & kMask) * kX + (cell.y & kMask) * kY + (cell.z & kMask);
  const float x = p.x - float(cell.x), y = p.y - float(cell.y), z = p.z - float(cell.z);
  const float low = between(between(v[0], v[1], z), between(v[kY], v[kY + 1], z), y);
  const float high =
      between(between(v[kX], v[kX + 1], z), between(v[kX + kY], v[kX + kY + 1], z), y);
  return between(low, high, x);
}

/// The gradient of the values of a brick. \param low  lowest corner of the brick
ESVR_HD inline FloatPlace gradientIn(const float* values, const FloatPlace& p, const Coord& low) {
  const FloatPlace local{p.x - float(low.x), p.y - float(low.y), p.z - float(low.z)};
  constexpr int kLast = kBrickSide - 1;
  const auto cellAt = [](float at) { return at < float(kLast) ? int(at) : kLast; };
  return gradientAt(local, float(kBrickSide), [&](const FloatPlace& at) {
    return interpolate(values, at, {cellAt(at.x), cellAt(at.y), cellAt(at.z)});
  });
}

ESVR_HD inline Coord cellOf(const FloatPlace& p) {
  return {int(std::floor(p.x)), int(std::floor(p.y)), int(std::floor(p.z))};
}

ESVR_HD inline bool inside(const BrickTableView& a, const Coord& v) {
  // Negative numbers become too large ones.
  return std::uint32_t(v.x) < std::uint32_t(a.blocks.x * kBlockSide) &&
         std::uint32_t(v.y) < std::uint32_t(a.blocks.y * kBlockSide) &&
         std::uint32_t(v.z) < std::uint32_t(a.blocks.z * kBlockSide);
}

}  // namespace brick_march

/// A ray whose first samples have been added.
struct RayProgress {
  RayState ray;
  int next = 0;   ///< first sample that has not been added
  int level = 0;  ///< place of that sample's level in a LevelScene
  Shade shade;    ///< at the last sample that was added; used if the scene is shaded
};

/// The visitor of a march whose bricks all have slots or are vacant.
struct AllBricksAreThere {
  ESVR_HD void entered(std::uint32_t) const {}
  ESVR_HD bool wantsMore(std::uint32_t, std::uint32_t) const { return false; }
};

/// A sample and where its value comes from.
struct BrickSample {
  const float* values;  ///< of the brick
  Coord low;            ///< lowest corner of the brick
  FloatPlace place;
  float value;
  SampleNumber number;
};

/// Adds samples whose colors are not lit.
struct UnlitSamples {
  ESVR_HD void add(const SampleRule& rule, const BrickSample& sample, RayProgress& at) const {
    rule.add(at.ray, sample.value, sample.number);
  }
};
/// Adds samples whose colors are lit by their gradients.
struct LitSamples {
  LightRule light;
  FloatPlace direction;  ///< of the ray in the camera's space, of unit length

  ESVR_HD void add(const SampleRule& rule, const BrickSample& sample, RayProgress& at) const {
    const FloatPlace gradient = brick_march::gradientIn(sample.values, sample.place, sample.low);
    const Shade shade = light.shadeOf(gradient, direction);
    rule.add(at.ray, sample.value, sample.number, Shades{at.shade, shade});
    at.shade = shade;
  }
};

/// Adds samples to a ray until it ends or meets a brick that is missing.
/// \param scene    its box and view are relative to the table's origin
/// \param slots    BrickSlotsView, or a type with the same functions
/// \param visitor  entered(slot) is called for each slot that the ray reads. wantsMore(brick, slot)
///                 is called for each missing brick; while it returns true, the march looks for
///                 further missing bricks on the ray, without adding samples
/// \param adding   UnlitSamples or LitSamples
/// \return true if the ray has ended
template <class Slots, class Visitor, class Adding = UnlitSamples>
ESVR_HD inline bool marchBricks(const BrickTableView& table, const Slots& slots,
                                const MarchScene& scene, const MarchSamples& samples,
                                RayProgress& at, Visitor& visitor, const Adding& adding = {}) {
  using namespace brick_march;
  Found found = nothingAt({-1, -1, -1});
  const float* values = nullptr;
  bool looksAhead = false;
  for (int i = at.next > samples.begin ? at.next : samples.begin;
       i < samples.end && scene.rule.open(at.ray);) {
    const FloatPlace place = samples.at(i);
    const Coord cell = cellOf(place);
    if (!found.contains(cell)) {
      // Rounding can move a place beyond the box.
      found = inside(table, cell) ? find(table, cell) : nothingAt(cell);
      const std::uint32_t slot =
          found.brick == kNoCells ? BrickSlotsView::kVacant : slots.slot(found.brick);
      const bool there = slots.hasSlot(slot);
      values = there && !looksAhead ? slots.values(slot) : nullptr;
      if (there && !looksAhead) visitor.entered(slot);
      if (!there && slot != BrickSlotsView::kVacant) {
        if (!looksAhead) at.next = i;
        looksAhead = true;
        if (!visitor.wantsMore(found.brick, slot)) return false;
      }
    }
    if (values == nullptr) {
      i += march::samplesToLeave(place, samples.perVoxel, found.low, found.side);
      continue;
    }
    const float value = interpolate(values, place, cell);
    if (value != scene.rule.background)
      adding.add(scene.rule, {values, found.low, place, value, samples.numberOf(i)}, at);
    ++i;
  }
  return !looksAhead;
}

}  // namespace esvr
