#pragma once
/// Implements inspectVdb and readGrid for .nvdb files. Errors do not name the file.

#include <string>

#include "esvr/vdb_io.h"
#include "vdb/input_file.h"

namespace esvr::vdb {

VdbSummary inspectNanoVdb(InputFile& file);
VolumeGrid readNanoVdbGrid(InputFile& file, const std::string& name, const ReadOptions& options);

}  // namespace esvr::vdb
