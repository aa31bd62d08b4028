#pragma once
/// OpenVDB grids from volumes.

#include "esvr/vdb_io.h"
#include "vdb/versions.h"

#include <openvdb/Grid.h>

namespace esvr::vdb {

/// A grid with the volume's voxels and all that the descriptor names: a DoubleGrid where the source
/// was double, else a FloatGrid. Inactive voxels hold the background; in a level set whose
/// background is positive they and the space between get their sign by flood fill.
/// \throws UsageError  values that half cannot hold are to be saved as half
openvdb::GridBase::Ptr makeOpenVdbGrid(const VolumeGrid& grid, const WriteOptions& options);

}  // namespace esvr::vdb
