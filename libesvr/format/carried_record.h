#pragma once
/// The record of a carried grid: everything but its bytes.

#include "esvr/carried_grid.h"
#include "format/byte_reader.h"
#include "format/byte_writer.h"

namespace esvr::format {

void putCarried(ByteWriter& out, const CarriedGrid& grid);
[[nodiscard]] CarriedGrid getCarried(ByteReader& in);

}  // namespace esvr::format
