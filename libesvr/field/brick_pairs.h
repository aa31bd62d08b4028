#pragma once
/// Lists of the bricks that each ellipsoid reaches, and of the ellipsoids that reach each brick.

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/brick_index.h"
#include "field/support.h"

namespace esvr {

/// Pairs in brick order; within a brick in the ellipsoids' order, so that sums have one order.
struct BrickPairs {
  std::vector<std::uint32_t> brickBegin;      ///< bricks + 1: range of a brick's pairs
  std::vector<std::uint32_t> ellipsoid;       ///< a pair's ellipsoid
  std::vector<std::uint32_t> ellipsoidBegin;  ///< ellipsoids + 1: range in pairOf
  std::vector<std::uint32_t> pairOf;          ///< an ellipsoid's pairs, in brick order

  [[nodiscard]] std::size_t pairCount() const { return ellipsoid.size(); }
};

/// Support of ellipsoid i; called from several threads.
using SupportOf = std::function<Support(std::size_t)>;

/// Pairs over the bricks of an index. Bricks not in the index are left out.
/// \throws RuntimeFailure  2^32 pairs or more
[[nodiscard]] BrickPairs pairsWithin(const BrickIndex& index, std::size_t ellipsoids,
                                     const SupportOf& supportOf);

/// Bricks that some support reaches and the index lacks, in increasing order.
/// \param within  a box of brick coordinates; bricks elsewhere are left out
[[nodiscard]] std::vector<Coord> missingBricks(const BrickIndex& index, std::size_t ellipsoids,
                                               const SupportOf& supportOf,
                                               const Box& within = bricksOf(Box::whole()));

}  // namespace esvr
