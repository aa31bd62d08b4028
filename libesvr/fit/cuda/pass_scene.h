#pragma once
/// The data that every pass over the bricks reads: bricks, ellipsoids and pair lists.

#include <algorithm>
#include <bit>

#include "core/cuda/integer_sum.cuh"
#include "fit/cuda/pair_form.h"
#include "fit/cuda/pair_lists.h"

namespace esvr::cuda {

/// All pointers are to device memory that the caller owns.
struct PassScene {
  const Coord* bricks;  ///< the target's bricks first
  std::uint32_t brickCount, targetCount;
  std::uint32_t ellipsoidCount, pairCount;
  PairListsView lists;
  const PairForm* forms;  ///< one for each ellipsoid
};

[[nodiscard]] inline PassScene passScene(const BrickTable& bricks, const PairLists& lists,
                                         std::size_t ellipsoidCount, const PairForm* forms) {
  return {bricks.view().bricks,
          std::uint32_t(bricks.size()),
          std::uint32_t(bricks.targetCount()),
          std::uint32_t(ellipsoidCount),
          std::uint32_t(lists.pairCount()),
          lists.view(),
          forms};
}

/// \return an upper bound for the number of bricks with lists of kMaxNarrowEntries or more, which
///         come first in PairListsView::brickOrder; 0 if no list can be longer
[[nodiscard]] inline std::uint32_t maxWideBricks(const PassScene& scene) {
  static_assert(std::has_single_bit(kMaxNarrowEntries), "as PairListsView::brickOrder says");
  if (scene.ellipsoidCount <= kMaxNarrowEntries) return 0;
  return std::min(scene.brickCount, scene.pairCount / kMaxNarrowEntries);
}

}  // namespace esvr::cuda
