#pragma once
/// Evaluates a field over any number of bricks with a buffer of bounded size.

#include <cstddef>
#include <functional>
#include <span>

#include "esvr/coord.h"
#include "esvr/ellipsoids.h"
#include "esvr/sparse_volume.h"

namespace esvr {

/// Largest number of bricks that are evaluated at once. Their values take 32 MB.
inline constexpr std::size_t kBatchBricks = 16384;

/// Largest number of pairs of an ellipsoid and a brick that are listed at once, unless a single
/// brick has more. Their lists take 0.4 GB.
inline constexpr double kMaxListedPairs = 0x1p25;

/// Some bricks and their values.
struct BrickBatch {
  std::span<const Coord> corners;  ///< index corners
  std::span<float> all;  ///< kBrickVoxels values for each brick; a visitor may change them

  [[nodiscard]] std::size_t size() const { return corners.size(); }
  [[nodiscard]] std::span<float> values(std::size_t b) const {
    return all.subspan(b * kBrickVoxels, kBrickVoxels);
  }
};
using BatchVisitor = std::function<void(const BrickBatch&)>;

/// Calls `visit` for all bricks, in order and at most kBatchBricks at a time, from the calling
/// thread.
/// \param maxListed  see kMaxListedPairs
void forEachBatch(const Field& field, std::span<const Coord> corners, const BatchVisitor& visit,
                  double maxListed = kMaxListedPairs);

}  // namespace esvr
