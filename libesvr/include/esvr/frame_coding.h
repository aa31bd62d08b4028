#pragma once
/// Encodes and decodes a file as a frame of a sequence (sequence_file.h).

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "esvr/container.h"

namespace esvr {

/// Encodes a file as a frame of a sequence.
/// \param previous  the decoded frame before it, to which the bytes may refer; null: they refer to
///                  no other frame
/// \throws RuntimeFailure  as for encodeEsvr
[[nodiscard]] std::vector<std::byte> encodeFrame(const EsvrFile& frame, const EsvrFile* previous);

/// Decodes a frame.
/// \param nameForErrors  name of the file and the frame in error texts
/// \param previous  the decoded frame before it; null if the bytes refer to no other frame
/// \throws BadInput, MemoryExceeded  as for decodeEsvr
[[nodiscard]] EsvrFile decodeFrame(std::span<const std::byte> bytes,
                                   const std::string& nameForErrors, const ReadLimits& limits,
                                   const EsvrFile* previous);

/// True if decodeFrame needs `previous`. \throws BadInput  the bytes are not those of a frame
[[nodiscard]] bool dependsOnPrevious(std::span<const std::byte> bytes);

}  // namespace esvr
