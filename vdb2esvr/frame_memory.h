#pragma once
/// The memory that the conversion of a frame may take.

#include <cstdint>

#include "esvr/vdb_io.h"
#include "vdb2esvr/choose_grids.h"

namespace esvr::vdb2esvr {

/// An upper estimate of the memory in bytes that the conversion of a file takes, from the summary
/// of the file. The grids are fitted one after the other, beside the bytes of all carried grids. It
/// decides how many frames are converted at the same time; no result depends on it.
[[nodiscard]] std::uint64_t conversionMemory(const VdbSummary& file, const GridChoice& grids);

}  // namespace esvr::vdb2esvr
