#pragma once
/// Decodes the bytes of a container from any source.

#include <cstddef>
#include <span>
#include <string>

#include "esvr/container.h"
#include "format/bytes.h"

namespace esvr::format {

/// Decodes a whole container. \throws BadInput, MemoryExceeded
[[nodiscard]] EsvrFile decode(const ByteSource& source, const ReadLimits& limits = {});

/// Decodes the short form of a frame (frame_table.h).
/// \throws BadInput, MemoryExceeded
[[nodiscard]] EsvrFile decodeShort(std::span<const std::byte> bytes, const std::string& name,
                                   const ReadLimits& limits, const EsvrFile& previous);

/// Decodes a part of a container. \throws BadInput, MemoryExceeded
[[nodiscard]] PartOfFile decodePart(const ByteSource& source, const ReadPart& part);

}  // namespace esvr::format
