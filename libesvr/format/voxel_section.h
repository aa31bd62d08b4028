#pragma once
/// A voxel layer as the content of a section, encoded by voxel_coder.h.

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "core/memory_budget.h"
#include "esvr/quantised.h"
#include "format/bytes.h"

namespace esvr::format {

/// Bits that the place of a brick may have along an axis, from the first brick on.
inline constexpr int kMaxBrickBits = 21;

[[nodiscard]] std::vector<std::byte> putVoxels(const VoxelLayer& layer);

/// True if the section takes more than a number of bytes. Coding stops where that is known.
[[nodiscard]] bool takeMore(const VoxelLayer& layer, std::uint64_t bytes);

/// \throws BadInput  the content is damaged; the text begins with `where`
/// \throws MemoryExceeded  there are more bricks than the budget allows
[[nodiscard]] VoxelLayer getVoxels(std::span<const std::byte> content, const std::string& where,
                                   MemoryBudget& budget);

// The parts of a section of voxels that a predicted grid has too.

/// The form, the divisor, the origin, the background and the palette.
void putVoxelHead(ByteWriter& out, const VoxelLayer& layer);
[[nodiscard]] VoxelLayer getVoxelHead(ByteReader& in);
/// The divisor alone.
[[nodiscard]] double getDivisor(ByteReader& in);

/// Largest number of bricks that a section may have without a previous frame, so that a reader knows
/// it before it allocates memory.
[[nodiscard]] std::uint64_t maxBricksIn(std::uint64_t bytes);
/// The number of bytes that a section needs for bricks that the previous frame has not.
[[nodiscard]] std::uint64_t bytesForBricks(std::uint64_t bricks);

/// Takes the memory of bricks while they are read from a budget.
void takeBricks(std::uint64_t bricks, const std::string& where, MemoryBudget& budget);

/// Refuses bricks that reach out of the index space.
void checkBricks(const VoxelLayer& layer, const ByteReader& in);

/// Refuses codes without a value, and values that are not finite.
void checkVoxels(const VoxelLayer& layer, const ByteReader& in);

}  // namespace esvr::format
