#pragma once
/// .nvdb files behind inspectVdb and readGrid; errors lack the file's name.

#include <string>

#include "esvr/vdb_io.h"
#include "vdb/input_file.h"

namespace esvr::vdb {

VdbSummary inspectNanoVdb(InputFile& file);
VolumeGrid readNanoVdbGrid(InputFile& file, const std::string& name, const ReadOptions& options);

}  // namespace esvr::vdb
