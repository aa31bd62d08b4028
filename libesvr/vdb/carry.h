#pragma once
/// Reads grids of .vdb files as bytes, and reads the voxels of such grids.

#include <span>
#include <string>
#include <vector>

#include "esvr/vdb_io.h"
#include "vdb/input_file.h"

namespace esvr::vdb {

/// True if OpenVDB's name of a tree is that of points.
bool isPointTree(const std::string& treeType);

/// The reason, for the user, why a grid of a file of this version cannot be carried; else empty.
std::string whyNotCarried(const std::string& treeType, std::uint32_t vdbVersion);

/// \throws BadInput, MemoryExceeded  as for readCarried
std::vector<CarriedGrid> readOpenVdbCarried(InputFile& file, std::span<const std::size_t> places,
                                            const ReadOptions& options);

}  // namespace esvr::vdb
