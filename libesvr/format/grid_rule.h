#pragma once
/// The rule that determines the voxels of a stored grid from its sum of ellipsoids, and the voxels of some bricks of a grid, so
/// that a volume which is larger than the memory can be looked at piece by piece.

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "esvr/container.h"
#include "esvr/grid_coding.h"
#include "field/voxel_rule.h"

namespace esvr::format {

/// A threshold below every activity.
inline constexpr float kAlwaysActive = -std::numeric_limits<float>::max();

[[nodiscard]] VoxelRule ruleOf(const StoredGrid& grid);

/// Index corners, increasing, of the bricks in which decodeGrid() may return an active voxel.
/// \throws MemoryExceeded  as for reachedBricks (field.h)
[[nodiscard]] std::vector<Coord> decodedBricks(const StoredGrid& grid,
                                               const DecodeOptions& options);

/// The voxels of decodeGrid() in these bricks; `options.maxBytes` is ignored.
/// \param bricks  increasing corners
/// \throws UsageError  as for decodeGrid
[[nodiscard]] SparseVolume decodeBricks(const StoredGrid& grid, const DecodeOptions& options,
                                        std::span<const Coord> bricks);

/// The vectors of three components, each of which decode(component, left) makes within the memory that is left.
template <class Decode>
VectorGrid vectorsOf(const std::string& name, StoredComponents components,
                     const DecodeOptions& options, const Decode& decode) {
  VectorGrid vectors;
  DecodeOptions left = options;
  for (std::size_t c = 0; c < kComponents; ++c) {
    VolumeGrid component = decode(components[c], left);
    if (c == 0) vectors.descriptor = std::move(component.descriptor);
    vectors.background[c] = components[c].descriptor.background;
    vectors.components[c] = std::move(component.volume);
    const std::uint64_t bytes = vectors.components[c].values.size() * sizeof(float);
    if (left.maxBytes != kNoMemoryLimit && !left.memory.isInFile(bytes))
      left.maxBytes -= std::min(left.maxBytes, bytes);
  }
  vectors.descriptor.name = name;
  return vectors;
}

}  // namespace esvr::format
