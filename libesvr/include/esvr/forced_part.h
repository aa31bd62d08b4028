#pragma once
/// Adds a part to a stored grid that it does not need, without changing its voxels, to measure what
/// leaving the part out saves (docs/figures/economy.md, `left_out` of the reports). Conversions never store
/// such parts.
///
/// Ellipsoids are stored in the order of their centers. The voxels stay the same bit for bit if the
/// grid was read from a file; in another order of the ellipsoids, sums are rounded in another way.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "esvr/container.h"

namespace esvr {

enum class Part {
  kRotations,
  kSigns,   ///< a sign for each quantised intensity
  kKappas,  ///< a kappa for each ellipsoid
  kResidual,
  kMask,
  kLevels,  ///< thresholds of blocks (TopologyKind::kBlocks)
  kLayers,  ///< importance layers
  kChunks,  ///< a table of chunks
};

struct NamedPart {
  Part part;
  const char* name;
};
[[nodiscard]] const std::vector<NamedPart>& allParts();

/// What a grid has of a part, or what keeps it from having it.
struct PartState {
  bool stored = false;
  /// Why forcing the part in makes no sense; empty if forcedPart() can do it, or if it is stored.
  std::string why{};
};
[[nodiscard]] PartState stateOf(const StoredGrid& grid, Part part);

/// The grid with a part that stateOf() says it lacks and can have.
/// \param decoded  decodeGrid(grid)
[[nodiscard]] StoredGrid forcedPart(const StoredGrid& grid, Part part, const SparseVolume& decoded);

/// Bytes that a grid adds to a file (bytesAdded()).
struct PartBytes {
  std::uint64_t with = 0, without = 0;
};
/// What a part would cost; nothing if the grid has the part or cannot have it.
/// \param decoded  decodeGrid(grid)
[[nodiscard]] std::optional<PartBytes> bytesWithPart(const StoredGrid& grid, Part part,
                                                     const SparseVolume& decoded);

}  // namespace esvr
