#pragma once
/// Implements inspectVdb and readGrid for .vdb files. Grids are given by their
/// places in the file. Errors do not name the file.

#include <cstddef>

#include "esvr/vdb_io.h"
#include "vdb/input_file.h"

namespace esvr::vdb {

VdbSummary inspectOpenVdb(InputFile& file);
VolumeGrid readOpenVdbGrid(InputFile& file, std::size_t place, const ReadOptions& options);
VolumeGrid readOpenVdbComponent(InputFile& file, std::size_t place, std::size_t component,
                                const ReadOptions& options);
VectorGrid readOpenVdbVector(InputFile& file, std::size_t place, const ReadOptions& options);
PackedGrid readOpenVdbPacked(InputFile& file, std::size_t place, const ReadOptions& options);

}  // namespace esvr::vdb
