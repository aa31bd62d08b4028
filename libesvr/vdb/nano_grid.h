#pragma once
/// Voxels from a NanoVDB grid in memory.

#include "esvr/vdb_io.h"
#include "vdb/nano_file.h"

namespace esvr::vdb {

/// OpenVDB's name for the values of a NanoVDB grid ("float"), or NanoVDB's own where OpenVDB has
/// none ("fp8").
std::string nanoValueType(std::uint32_t gridType);

/// True for float, double and the quantised floats.
bool isScalarFloatNano(std::uint32_t gridType);

/// The grid in `buffer`, without its name and class. Every offset is checked before it is followed.
/// \throws BadInput  damaged; no active voxel; non-finite voxels; more than options.maxBytes
VolumeGrid readNanoVoxels(const NanoBuffer& buffer, std::uint32_t gridType, GridClass gridClass,
                          const ReadOptions& options);

}  // namespace esvr::vdb
