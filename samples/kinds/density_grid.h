#pragma once
/// A volume as a grid that other programs read.

#include <string>

#include "esvr/vdb_io.h"

namespace esvr::samples {

/// A grid of class fog volume, saved as float.
[[nodiscard]] VolumeGrid densityGrid(SparseVolume volume, const Transform& transform,
                                     const std::string& name = "density");

}  // namespace esvr::samples
