#pragma once
/// Divides a number of ellipsoids among the chunks of a fit.

#include <cstddef>
#include <span>
#include <vector>

namespace esvr {

/// What is known of a chunk.
struct ChunkNeed {
  double error = 0.0;     ///< sum of squares with its present ellipsoids
  double count = 0.0;     ///< its present ellipsoids, or before the fit a number in proportion
  std::size_t least = 0;  ///< smallest number of ellipsoids
  std::size_t most = 0;   ///< largest number of ellipsoids
};

/// Divides `count` so that a further ellipsoid lowers the error of every chunk by the same amount,
/// within each chunk's limits. The error of a chunk is taken to fall by kDbPerDoubling where the
/// number of its ellipsoids doubles.
/// \return a number for each chunk; together `count`, if the limits allow it
[[nodiscard]] std::vector<std::size_t> dividedCount(std::size_t count,
                                                    std::span<const ChunkNeed> needs);

}  // namespace esvr
