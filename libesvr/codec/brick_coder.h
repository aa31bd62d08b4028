#pragma once
/// Codes which bricks exist. Bricks of a past set and those that touch it are flags in the context of
/// that set; other bricks are a tree of cells.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include "codec/brick_order.h"
#include "codec/cell_tree.h"
#include "codec/symbol_coder.h"
#include "core/axes.h"
#include "core/brick_index.h"
#include "esvr/coord.h"
#include "esvr/error.h"

namespace esvr::codec {

/// Bits of the number of a brick's position along an axis.
inline constexpr int kFrameBrickBits = 21;

/// True if a position can be coded.
[[nodiscard]] inline bool isInside(Coord brick) {
  constexpr std::int32_t kEnd = 1 << kFrameBrickBits;
  const auto inside = [](std::int32_t place) { return place >= 0 && place < kEnd; };
  return inside(brick.x) && inside(brick.y) && inside(brick.z);
}

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

}  // namespace esvr::codec
