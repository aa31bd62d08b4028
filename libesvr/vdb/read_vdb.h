#pragma once
/// .vdb files behind inspectVdb and readGrid; errors lack the file's name.

#include <string>

#include "esvr/vdb_io.h"
#include "vdb/input_file.h"

namespace esvr::vdb {

VdbSummary inspectOpenVdb(InputFile& file);
VolumeGrid readOpenVdbGrid(InputFile& file, const std::string& name, const ReadOptions& options);

}  // namespace esvr::vdb
