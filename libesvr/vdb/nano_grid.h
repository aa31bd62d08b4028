#pragma once
/// Reads voxels from a NanoVDB grid in memory.

#include "esvr/vdb_io.h"
#include "vdb/nano_file.h"

namespace esvr::vdb {

/// OpenVDB's name for the value type of a NanoVDB grid ("float"), or NanoVDB's own name if OpenVDB
/// has none ("fp8").
std::string nanoValueType(std::uint32_t gridType);

/// True for float, double and the quantised floats.
bool isScalarFloatNano(std::uint32_t gridType);

/// Reads the grid in `buffer`, without its name and class. Every offset is checked before it is
/// followed.
/// \throws BadInput  the grid is damaged or has no active voxel; voxels are not finite
/// \throws MemoryExceeded  it takes more than options.maxBytes
VolumeGrid readNanoVoxels(const NanoBuffer& buffer, std::uint32_t gridType, GridClass gridClass,
                          const ReadOptions& options);

}  // namespace esvr::vdb
