#pragma once
/// A container's bytes, wherever they come from, as grids.

#include "esvr/container.h"
#include "format/byte_source.h"

namespace esvr::format {

/// \throws BadInput, MemoryExceeded
[[nodiscard]] EsvrFile decode(const ByteSource& source, const ReadLimits& limits = {});

/// \throws BadInput, MemoryExceeded
[[nodiscard]] EsvrFile decodePart(const ByteSource& source, const ReadPart& part);

}  // namespace esvr::format
