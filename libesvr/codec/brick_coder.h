#pragma once
/// Sets of places: Morton keys, the order of bricks, and the coders of sets of cells and of bricks.
///
/// The order of the ellipsoids in a cell, or of the bricks of a grid, has no meaning. A set of Morton keys is
/// therefore coded as a tree, in which an order costs no bits. The bricks of a frame are coded as flags in the
/// context of the bricks of the previous frame, and only the others as a tree.

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "codec/range_coder.h"
#include "core/brick_index.h"
#include "core/geometry.h"
#include "esvr/error.h"
#include "esvr/volume.h"

namespace esvr {

// ---- Morton keys, in which the bits of three coordinates alternate

/// Spreads the lowest 21 bits, so that two zero bits lie between neighbours.
constexpr std::uint64_t spreadBits(std::uint64_t v) {
  v = (v | v << 32) & 0x1f00000000ffff;
  v = (v | v << 16) & 0x1f0000ff0000ff;
  v = (v | v << 8) & 0x100f00f00f00f00f;
  v = (v | v << 4) & 0x10c30c30c30c30c3;
  v = (v | v << 2) & 0x1249249249249249;
  return v;
}

/// The inverse of spreadBits: takes every third bit, from the lowest.
constexpr std::uint32_t gatherBits(std::uint64_t v) {
  v &= 0x1249249249249249;
  v = (v | v >> 2) & 0x10c30c30c30c30c3;
  v = (v | v >> 4) & 0x100f00f00f00f00f;
  v = (v | v >> 8) & 0x1f0000ff0000ff;
  v = (v | v >> 16) & 0x1f00000000ffff;
  v = (v | v >> 32) & 0x1fffff;
  return std::uint32_t(v);
}

namespace codec {

/// The Morton key of a brick, whose coordinates are not negative.
[[nodiscard]] inline std::uint64_t keyOf(Coord brick) {
  return spreadBits(std::uint64_t(brick.x)) | spreadBits(std::uint64_t(brick.y)) << 1 |
         spreadBits(std::uint64_t(brick.z)) << 2;
}

[[nodiscard]] inline Coord brickAt(std::uint64_t key) {
  return {std::int32_t(gatherBits(key)), std::int32_t(gatherBits(key >> 1)),
          std::int32_t(gatherBits(key >> 2))};
}

/// The bricks in Morton order, in which the voxel coder visits them: no brick comes before one that is lower along
/// every axis.
[[nodiscard]] inline std::vector<std::size_t> codingOrder(const std::vector<Coord>& bricks) {
  std::vector<std::size_t> order(bricks.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return keyOf(bricks[a]) < keyOf(bricks[b]); });
  return order;
}

// ---- A set of cells

/// Codes a set of sorted Morton keys as a tree: for every split it stores how many keys have a 0 in the next bit.
/// \tparam Side  with a Writer, code() takes sorted keys; with a Reader it takes zeros and sets the
///               keys
template <class Side>
class CellTree {
 public:
  explicit CellTree(Side& side) : side_(side) {}

  /// \param bits  number of bits of a key
  void code(std::span<std::uint64_t> keys, int bits) {
    if (keys.empty() || bits == 0) return;
    const std::uint64_t bit = std::uint64_t{1} << (bits - 1);
    const auto n = std::uint32_t(keys.size());
    const auto right = std::find_if(keys.begin(), keys.end(), [bit](auto k) { return k & bit; });
    const std::uint32_t zeros = codeSplit(n, std::uint32_t(right - keys.begin()), bits);
    if (zeros > n) throw BadInput("a split of more ellipsoids than there are");
    for (auto& key : keys.subspan(zeros)) key |= bit;
    code(keys.first(zeros), bits - 1);
    code(keys.subspan(zeros), bits - 1);
  }

 private:
  static constexpr std::uint32_t kSmall = 16;
  static constexpr int kSmallBits = 4;

  std::uint32_t codeSplit(std::uint32_t n, std::uint32_t zeros, int level) {
    if (n == 1) return side_.bit(single_[std::size_t(level)], zeros != 0) ? 1 : 0;
    if (n < kSmall) return small_[n].code(side_, zeros);
    return codeLarge(n, zeros);
  }

  /// Codes the number of zeros as its distance from half of the keys.
  std::uint32_t codeLarge(std::uint32_t n, std::uint32_t zeros) {
    const auto width = std::size_t(std::bit_width(n));
    const std::uint32_t half = n / 2;
    const bool above = side_.bit(above_[width], zeros > half);
    const std::uint32_t distance = large_[width].code(side_, above ? zeros - half : half - zeros);
    if (above) return half + distance;
    return distance > half ? n + 1 : half - distance;
  }

  Side& side_;
  std::array<BitModel, 64> single_;
  std::array<TreeModel<kSmallBits>, kSmall> small_;
  std::array<BitModel, 33> above_;
  std::array<NumberModel, 33> large_;
};

// ---- The bricks of a frame

/// Bits of the number of a brick's position along an axis.
inline constexpr int kFrameBrickBits = 21;

/// True if a position can be coded.
[[nodiscard]] inline bool isInside(Coord brick) {
  constexpr std::int32_t kEnd = 1 << kFrameBrickBits;
  const auto inside = [](std::int32_t place) { return place >= 0 && place < kEnd; };
  return inside(brick.x) && inside(brick.y) && inside(brick.z);
}

/// Codes which bricks exist. Bricks of a past set and those that touch it are flags in the context of that set;
/// other bricks are a tree of cells.
/// \tparam Past  the past set: count() bricks at brickAt(b), find(brick) as BrickIndex::find,
///               keptContext(b) below kKeptContexts for each of them, and addedContext(brick) below
///               kAddedContexts for a brick that touches the set
template <class Side, class Past>
class BrickCoder {
 public:
  /// \param bricks  what a writer codes, increasing; a reader gives none
  BrickCoder(Side& side, const Past& past, std::vector<Coord> bricks)
      : side_(side), past_(past), bricks_(std::move(bricks)) {}

  /// \param maxNew  largest number of bricks that neither are in the past set nor touch it
  /// \return the bricks, increasing
  /// \throws BadInput  a reader finds more of these, or a brick twice
  std::vector<Coord> code(std::uint64_t maxNew) {
    codeOld();
    codeNeighbours();
    codeRest(maxNew);
    std::sort(coded_.begin(), coded_.end());
    if (std::adjacent_find(coded_.begin(), coded_.end()) != coded_.end())
      throw BadInput("a brick is there twice");
    return std::move(coded_);
  }

 private:
  /// Codes whether a brick exists.
  void codeBrick(BitModel& model, Coord brick) {
    if (side_.bit(model, std::binary_search(bricks_.begin(), bricks_.end(), brick)))
      coded_.push_back(brick);
  }

  void codeOld() {
    for (std::size_t b = 0; b < past_.count(); ++b)
      if (const Coord brick = past_.brickAt(b); isInside(brick))
        codeBrick(kept_[past_.keptContext(b)], brick);
  }

  void codeNeighbours() {
    for (std::size_t b = 0; b < past_.count(); ++b)
      for (const auto axis : kAxes)
        for (const int step : {-1, 1}) {
          Coord brick = past_.brickAt(b);
          brick.*axis += step;
          if (isInside(brick) && past_.find(brick) == BrickIndex::kNone) neighbours_.insert(brick);
        }
    for (const Coord brick : neighbours_) codeBrick(added_[past_.addedContext(brick)], brick);
  }

  void codeRest(std::uint64_t maxNew) {
    std::vector<std::uint64_t> keys;
    for (const Coord brick : bricks_)
      if (past_.find(brick) == BrickIndex::kNone && !neighbours_.contains(brick))
        keys.push_back(keyOf(brick));
    std::sort(keys.begin(), keys.end());
    const std::uint64_t count = count_.code(side_, std::uint64_t(keys.size()));
    if (count > maxNew) throw BadInput("more bricks than its bytes can hold");
    keys.resize(count);
    CellTree<Side>(side_).code(keys, 3 * kFrameBrickBits);
    for (const std::uint64_t key : keys) coded_.push_back(codec::brickAt(key));
  }

  Side& side_;
  const Past& past_;
  std::vector<Coord> bricks_, coded_;
  std::set<Coord> neighbours_;
  std::array<BitModel, Past::kKeptContexts> kept_;
  std::array<BitModel, Past::kAddedContexts> added_;
  NumberModelOf<6> count_;
};

}  // namespace codec

}  // namespace esvr
