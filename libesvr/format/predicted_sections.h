#pragma once
/// Voxels that are coded with other voxels as context (codec/frame_coder.h): those of the previous frame of a sequence,
/// or those of another grid of the file.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/memory_budget.h"
#include "esvr/container.h"

namespace esvr::format {

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

/// Encodes voxels.
/// \param reference  what is written of it; the layer that it names is `of`
/// \param of  null: the context is empty
/// \return nothing if the layer cannot be coded with this context
[[nodiscard]] std::optional<std::vector<std::byte>> putRelated(const VoxelLayer& layer,
                                                               const VoxelReference& reference,
                                                               const VoxelLayer* of);

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
