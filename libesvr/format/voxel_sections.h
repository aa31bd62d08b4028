#pragma once
/// Sections of voxels: where they are active, as positions of bricks and masks, and layers of values, which are encoded by
/// codec/voxel_coder.h, or by codec/frame_coder.h with other voxels as context: those of the previous frame of a sequence, or
/// those of another grid of the file.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/memory_budget.h"
#include "esvr/container.h"
#include "esvr/quantised.h"
#include "esvr/volume.h"
#include "format/bytes.h"

namespace esvr::format {

/// Bits that the place of a brick may have along an axis, from the first brick on.
inline constexpr int kMaxBrickBits = 21;

// ---- Positions of bricks: one array for each axis

/// \throws RuntimeFailure  the corners are not multiples of 8, or not increasing
[[nodiscard]] std::vector<std::byte> putBricks(std::span<const Coord> corners);

/// \throws BadInput  the content is not a list of increasing corners; the text begins with `where`
[[nodiscard]] std::vector<Coord> getBricks(std::span<const std::byte> content,
                                           const std::string& where);

// ---- Masks of active voxels

struct Mask {
  std::vector<Coord> bricks;  ///< index corners of the bricks, increasing
  std::vector<BrickMask> active;
};

/// \throws RuntimeFailure  the corners are not multiples of 8, not increasing, or too far apart
[[nodiscard]] std::vector<std::byte> putMask(std::span<const Coord> bricks,
                                             std::span<const BrickMask> active);

/// \throws BadInput  the content is damaged; the text begins with `where`
/// \throws MemoryExceeded  there are more bricks than the budget allows
[[nodiscard]] Mask getMask(std::span<const std::byte> content, const std::string& where,
                           MemoryBudget& budget);

// ---- Layers of voxels

/// The section of a layer. It is coded, unless the layer has kept it.
[[nodiscard]] std::vector<std::byte> putVoxels(const VoxelLayer& layer);
/// Codes a layer and keeps its section in it. \return the bytes of the section
std::uint64_t keepCoded(VoxelLayer& layer);

/// \throws BadInput  the content is damaged; the text begins with `where`
/// \throws MemoryExceeded  there are more bricks than the budget allows
[[nodiscard]] VoxelLayer getVoxels(std::span<const std::byte> content, const std::string& where,
                                   MemoryBudget& budget);

/// Takes the memory of bricks while they are read from a budget. \return where their codes are
[[nodiscard]] VoxelMemory takeBricks(std::uint64_t bricks, const std::string& where,
                                     MemoryBudget& budget);

// ---- A grid of voxels as its difference from the same grid of the previous frame

/// The content of a section of the kind kPredicted; nothing if the grid cannot be predicted.
[[nodiscard]] std::optional<std::vector<std::byte>> putPredicted(const StoredGrid& grid,
                                                                 const StoredGrid& previous);

/// \throws BadInput  the content is damaged, or does not belong to this previous grid; the text
///                   begins with `where`
/// \throws MemoryExceeded  there are more bricks than the budget allows
[[nodiscard]] StoredGrid getPredicted(std::span<const std::byte> content, const std::string& where,
                                      const StoredGrid& previous, MemoryBudget& budget);

// ---- Voxels with those of another grid of the file as context (docs/format.md, "Related voxels")

/// Largest number of bytes at the beginning of a section that say which grid it refers to.
inline constexpr std::uint64_t kReferenceBytes = 5;

/// Encodes voxels, unless the layer has kept this section.
/// \param reference  what is written of it; the layer that it names is `of`
/// \param of  null: the context is empty
/// \return nothing if the layer cannot be coded with this context
[[nodiscard]] std::optional<std::vector<std::byte>> putRelated(const VoxelLayer& layer,
                                                               const VoxelReference& reference,
                                                               const VoxelLayer* of);
/// Encodes voxels and keeps the section in their layer, if it can be coded. putRelated() with the same arguments returns it.
void keepRelated(VoxelLayer& layer, const VoxelReference& reference, const VoxelLayer* of);

/// The grid that a section refers to, from its first bytes. \throws BadInput
[[nodiscard]] std::optional<std::size_t> referenceIn(std::span<const std::byte> begin,
                                                     const std::string& where);

/// Decodes the voxels and the reference of a grid.
/// \param before  the grids before this one
/// \throws BadInput  the content is damaged; it refers to a grid that is not before this one or has
///                   no voxels; the text begins with `where`
/// \throws MemoryExceeded  there are more bricks than the budget allows
void getRelated(std::span<const std::byte> content, const std::string& where,
                std::span<const StoredGrid> before, MemoryBudget& budget, StoredGrid& grid);

}  // namespace esvr::format
