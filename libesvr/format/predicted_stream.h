#pragma once
/// The stream of a layer that is coded with other voxels as context (codec/frame_coder.h).

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "codec/past_voxels.h"
#include "core/memory_budget.h"
#include "esvr/voxel_layer.h"
#include "format/byte_reader.h"

namespace esvr::format {

[[nodiscard]] std::vector<std::byte> encodePredicted(const VoxelLayer& layer,
                                                     const codec::PastVoxels& past);

/// Where the memory of a reader comes from, and the start of its error texts.
struct ReaderPlace {
  const std::string& where;
  MemoryBudget& budget;
};

/// Reads the bricks and the voxels of a layer from the rest of a section.
/// \param maxBricks  largest number of bricks
/// \throws BadInput  the stream is damaged
/// \throws MemoryExceeded  there are more bricks than the budget allows
void decodePredicted(ByteReader& in, const codec::PastVoxels& past, std::uint64_t maxBricks,
                     const ReaderPlace& place, VoxelLayer& layer);

}  // namespace esvr::format
