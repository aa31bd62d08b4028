#pragma once
/// The memory that the conversion of a frame may take.

#include <cstdint>

#include "esvr/vdb_io.h"

namespace esvr::vdb2esvr {

/// An upper estimate of the memory in bytes that the conversion of a file takes, from the summary
/// of the file. The grids are converted one after the other. It decides how many frames are
/// converted at the same time; no result depends on it.
[[nodiscard]] std::uint64_t conversionMemory(const VdbSummary& file);

}  // namespace esvr::vdb2esvr
