#pragma once
/// The readers of both formats, which vdb_io.cpp chooses from. Grids are given by their places in the
/// file. Errors do not name the file. The unique names of summaries are not set.

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "esvr/vdb_io.h"
#include "vdb/files.h"

namespace esvr::vdb {

// Of .vdb files (read_vdb.cpp).
VdbSummary inspectOpenVdb(InputFile& file);
VolumeGrid readOpenVdbGrid(InputFile& file, std::size_t place, const ReadOptions& options);
VolumeGrid readOpenVdbComponent(InputFile& file, std::size_t place, std::size_t component,
                                const ReadOptions& options);
VectorGrid readOpenVdbVector(InputFile& file, std::size_t place, const ReadOptions& options);
PackedGrid readOpenVdbPacked(InputFile& file, std::size_t place, const ReadOptions& options);
/// \throws BadInput, MemoryExceeded  as for readCarried
std::vector<CarriedGrid> readOpenVdbCarried(InputFile& file, std::span<const std::size_t> places,
                                            const ReadOptions& options);

// Of .nvdb files (read_nvdb.cpp).
/// True if the file begins as a NanoVDB file does.
bool beginsAsNanoVdb(InputFile& file);
VdbSummary inspectNanoVdb(InputFile& file);
VolumeGrid readNanoVdbGrid(InputFile& file, std::size_t place, const ReadOptions& options);
VolumeGrid readNanoVdbComponent(InputFile& file, std::size_t place, std::size_t component,
                                const ReadOptions& options);
VectorGrid readNanoVdbVector(InputFile& file, std::size_t place, const ReadOptions& options);

// Of both (vdb_io.cpp).
/// \throws BadInput  the file has no grid at this place
void requireGrid(std::size_t place, std::size_t grids);
/// The vectors of components that are read one after the other. Later components get the memory that earlier ones leave.
VectorGrid joinedComponents(
    ReadOptions options,
    const std::function<VolumeGrid(std::size_t component, const ReadOptions& options)>& read);
/// The reason, for the user, why a grid of this type is skipped.
std::string notAFloatType(const std::string& valueType);

}  // namespace esvr::vdb
