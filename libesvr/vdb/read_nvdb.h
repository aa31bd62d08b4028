#pragma once
/// Implements inspectVdb and readGrid for .nvdb files. Grids are given by their
/// places in the file. Errors do not name the file.

#include <cstddef>

#include "esvr/vdb_io.h"
#include "vdb/input_file.h"

namespace esvr::vdb {

VdbSummary inspectNanoVdb(InputFile& file);
VolumeGrid readNanoVdbGrid(InputFile& file, std::size_t place, const ReadOptions& options);

}  // namespace esvr::vdb
