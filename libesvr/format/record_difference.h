#pragma once
/// The record of a grid of a frame as its difference from the record of the previous frame.

#include <string>

#include "esvr/container.h"
#include "format/byte_reader.h"
#include "format/byte_writer.h"

namespace esvr::format {

/// Writes the record of a grid, without chunks.
void putRecordAfter(ByteWriter& out, const StoredGrid& grid, const StoredGrid& previous);

/// Reads it again. \throws BadInput  it does not belong to this previous grid, or is damaged
[[nodiscard]] StoredGrid getRecordAfter(ByteReader& in, const StoredGrid& previous,
                                        const std::string& where);

}  // namespace esvr::format
