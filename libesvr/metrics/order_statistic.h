#pragma once
/// An exact order statistic of the errors, without storing them.

#include <cstdint>
#include <span>

#include "metrics/brick_pairs.h"

namespace esvr::metrics {

/// The rank-th smallest |error| (from 1) over the union of active voxels. Selects the digits of the
/// answer's bit pattern one after the other by counting: memory does not follow the voxels, and
/// counts do not depend on the order of threads.
[[nodiscard]] double errorOfRank(std::span<const BrickPair> pairs, const Backgrounds& backgrounds,
                                 std::uint64_t rank);

/// Rank of a percentile by the nearest-rank definition: the smallest that at least `permille`
/// thousandths of `count` values do not exceed.
[[nodiscard]] std::uint64_t nearestRank(std::uint64_t count, std::uint64_t permille);

}  // namespace esvr::metrics
