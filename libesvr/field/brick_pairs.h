#pragma once
/// Lists of the bricks that each ellipsoid reaches, and of the ellipsoids that reach each brick.

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/brick_index.h"
#include "field/support.h"

namespace esvr {

/// The pairs, sorted by brick and, within a brick, by ellipsoid, so that sums have a fixed order.
struct BrickPairs {
  std::vector<std::uint32_t> brickBegin;      ///< by brick: its pairs are [b] to [b + 1] - 1
  std::vector<std::uint32_t> ellipsoid;       ///< by pair: its ellipsoid
  std::vector<std::uint32_t> ellipsoidBegin;  ///< by ellipsoid: its range in pairOf, as above
  std::vector<std::uint32_t> pairOf;          ///< numbers of an ellipsoid's pairs, by brick

  [[nodiscard]] std::size_t pairCount() const { return ellipsoid.size(); }
};

/// Returns the support of ellipsoid i. It is called from several threads.
using SupportOf = std::function<Support(std::size_t)>;

/// The pairs of ellipsoids and the bricks of an index. Other bricks are ignored.
/// \throws RuntimeFailure  there are 2^32 pairs or more
[[nodiscard]] BrickPairs pairsWithin(const BrickIndex& index, std::size_t ellipsoids,
                                     const SupportOf& supportOf);

/// The bricks that a support reaches and that are not in the index, in increasing order.
/// \param within  box of brick coordinates; bricks outside are ignored
[[nodiscard]] std::vector<Coord> missingBricks(const BrickIndex& index, std::size_t ellipsoids,
                                               const SupportOf& supportOf,
                                               const Box& within = bricksOf(Box::whole()));

}  // namespace esvr
