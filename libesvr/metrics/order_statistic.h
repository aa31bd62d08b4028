#pragma once
/// An exact order statistic of the errors, computed without storing them.

#include <cstdint>
#include <span>

#include "metrics/brick_pairs.h"

namespace esvr::metrics {

/// The rank-th smallest |error| (from 1) over the union of active voxels. The digits of its bit
/// pattern are determined one after the other by counting. The memory does not depend on the number
/// of voxels, and the counts do not depend on the order of threads.
[[nodiscard]] double errorOfRank(std::span<const BrickPair> pairs, std::uint64_t rank);

/// Rank of a percentile by the nearest-rank definition: the rank of the smallest value that at
/// least `permille` thousandths of `count` values do not exceed.
[[nodiscard]] std::uint64_t nearestRank(std::uint64_t count, std::uint64_t permille);

}  // namespace esvr::metrics
