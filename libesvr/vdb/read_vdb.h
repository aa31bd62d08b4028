#pragma once
/// Implements inspectVdb and readGrid for .vdb files. Errors do not name the file.

#include <string>

#include "esvr/vdb_io.h"
#include "vdb/input_file.h"

namespace esvr::vdb {

VdbSummary inspectOpenVdb(InputFile& file);
VolumeGrid readOpenVdbGrid(InputFile& file, const std::string& name, const ReadOptions& options);
VolumeGrid readOpenVdbComponent(InputFile& file, const std::string& name, std::size_t component,
                                const ReadOptions& options);
VectorGrid readOpenVdbVector(InputFile& file, const std::string& name, const ReadOptions& options);
PackedGrid readOpenVdbPacked(InputFile& file, const std::string& name, const ReadOptions& options);

}  // namespace esvr::vdb
