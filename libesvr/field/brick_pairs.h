#pragma once
/// The bricks that ellipsoids reach: their numbers, and lists of the bricks of each ellipsoid and of
/// the ellipsoids of each brick.

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/brick_index.h"
#include "field/support.h"

namespace esvr {

/// An upper bound of the number of bricks in a box that a support may touch.
[[nodiscard]] double maxBricks(const Support& support, const Box& within);

/// The number of bricks in a box that at least one support may touch. The count stops once it is
/// above `enough`.
[[nodiscard]] double countBricks(std::span<const Support> supports, const Box& within,
                                 double enough);

/// \throws MemoryExceeded  the supports may reach more than 2^32 bricks of a box together, whose list
///                         would take 48 GiB
void requireListable(std::span<const Support> supports, const Box& within);

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

/// The pairs of ellipsoids and all bricks that they reach. Bricks that the index does not have are
/// appended in increasing order.
/// \param within  box of brick coordinates; bricks outside that the index does not have are ignored
/// \throws RuntimeFailure  as above
[[nodiscard]] BrickPairs pairsOfAll(BrickIndex& index, std::size_t ellipsoids,
                                    const SupportOf& supportOf,
                                    const Box& within = bricksOf(Box::whole()));

/// The pairs of supports and bricks that are given by their corners.
/// \param corners  index corners of the bricks, multiples of 8
[[nodiscard]] BrickPairs pairsWith(std::span<const Support> reach, std::span<const Coord> corners);

/// The bricks that a support reaches and that are not in the index, in increasing order.
/// \param within  box of brick coordinates; bricks outside are ignored
[[nodiscard]] std::vector<Coord> missingBricks(const BrickIndex& index, std::size_t ellipsoids,
                                               const SupportOf& supportOf,
                                               const Box& within = bricksOf(Box::whole()));

/// Turns the lengths of lists into the offsets at which they begin; the last element, whose length
/// is 0, becomes the sum. \throws RuntimeFailure  the sum has more than 32 bits
void makeOffsets(std::vector<std::uint32_t>& lengths);

}  // namespace esvr
