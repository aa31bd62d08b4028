#pragma once
/// Decodes the bytes of a container from any source.

#include "esvr/container.h"
#include "format/byte_source.h"

namespace esvr::format {

/// Decodes a whole container.
/// \param previous  the previous frame, to which grids may refer; null: there is none
/// \throws BadInput, MemoryExceeded
[[nodiscard]] EsvrFile decode(const ByteSource& source, const ReadLimits& limits = {},
                              const EsvrFile* previous = nullptr);

/// Decodes a part of a container. \throws BadInput, MemoryExceeded
[[nodiscard]] EsvrFile decodePart(const ByteSource& source, const ReadPart& part);

}  // namespace esvr::format
