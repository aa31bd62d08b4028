#pragma once
/// Encodes the frames of a sequence. The voxels of a frame may refer to those of the frame before
/// it, which usually takes fewer bytes. docs/format.md, "Frames", specifies every byte.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "esvr/container.h"

namespace esvr {

/// Encodes a file as a frame. Each grid that holds voxels, and whose predecessor has the same number
/// in `previous` and holds voxels too, is stored as its difference from its predecessor if that
/// takes fewer bytes. All other grids are stored as encodeEsvr() stores them. The bytes are those of
/// encodeEsvr() if no grid refers to the previous frame. Otherwise they have a short form, without
/// the metadata, the vectors and the carried grids that are those of the previous frame.
/// \param previous  the frame before as decodeFrame() returned it; null: the frame stands alone
/// \throws RuntimeFailure  as for encodeEsvr
[[nodiscard]] std::vector<std::byte> encodeFrame(const EsvrFile& frame, const EsvrFile* previous);

/// Decodes a frame.
/// \param nameForErrors  name of the file and number of the frame in error texts
/// \param previous  the frame that encodeFrame() was given; ignored if the frame stands alone
/// \throws BadInput  as for decodeEsvr; the frame refers to the previous one, and `previous` is null
///                   or has not the grids that it refers to
/// \throws MemoryExceeded  as for readEsvr
[[nodiscard]] EsvrFile decodeFrame(std::span<const std::byte> bytes,
                                   const std::string& nameForErrors, const ReadLimits& limits,
                                   const EsvrFile* previous);

/// True if decodeFrame() needs the previous frame.
/// \throws BadInput  the header or the section table of a frame that stands alone is damaged
[[nodiscard]] bool dependsOnPrevious(std::span<const std::byte> bytes);

/// Largest number of bytes that a grid adds to a frame, like bytesAdded() for a file.
/// \param previous  the same grid of the previous frame; null: the grid is stored on its own
/// \throws RuntimeFailure  as for encodeEsvr
[[nodiscard]] std::uint64_t bytesInFrame(const StoredGrid& grid, const StoredGrid* previous);

}  // namespace esvr
