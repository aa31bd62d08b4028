#pragma once
/// The bricks of a volume as one array, for compressors of dense data where the box of the volume
/// does not fit into memory.

#include <cstddef>
#include <span>
#include <vector>

#include "esvr/sparse_volume.h"

namespace esvr::baselines {

/// The arrangement of bricks in a stack: brick b is at (0, b / length, b % length). ZFP allows
/// 65,536 voxels along an axis, which is why there may be several rows.
struct StackShape {
  std::size_t rows = 1, length = 0;

  [[nodiscard]] Box box() const;  ///< the voxels of the stack
};
[[nodiscard]] StackShape stackShape(std::size_t bricks);

/// The bricks of a volume side by side. An array of them has hardly any empty space, and blocks of
/// 4^3 voxels do not cross their borders.
[[nodiscard]] SparseVolume stackBricks(const SparseVolume& volume);

/// The inverse of stackBricks.
/// \param bricks  positions of all bricks, of which `stack` may lack some
[[nodiscard]] SparseVolume unstackBricks(const SparseVolume& stack, std::span<const Coord> bricks,
                                         Coord origin);

/// Brick positions as bytes, one byte for a brick that follows another one along z.
/// \param bricks  in increasing order, each >= 0
[[nodiscard]] std::vector<std::byte> encodeBricks(std::span<const Coord> bricks);

/// Decodes brick positions. `bytes` then begins behind them.
/// \throws BadInput  the bytes end too early
[[nodiscard]] std::vector<Coord> decodeBricks(std::span<const std::byte>& bytes);

}  // namespace esvr::baselines
