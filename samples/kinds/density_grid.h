#pragma once
/// Makes grids of volumes for VDB files.

#include <string>

#include "esvr/vdb_io.h"

namespace esvr::samples {

/// Makes a fog volume of float values.
[[nodiscard]] VolumeGrid densityGrid(SparseVolume volume, const Transform& transform,
                                     const std::string& name = "density");

}  // namespace esvr::samples
