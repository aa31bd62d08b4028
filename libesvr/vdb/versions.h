#pragma once
/// Handles the differences between OpenVDB 10 to 13 and the positions of NanoVDB's headers. Source
/// files of this folder include it before any other header of the two libraries.
///
/// OpenVDB 13 has no delayed loading. This library does not use it: grids are read from a stream of
/// its own (archive.h), which OpenVDB cannot map into memory, so all voxels are loaded when a read
/// returns.

#include <openvdb/version.h>

#include <algorithm>
#include <cstdint>

#if OPENVDB_LIBRARY_MAJOR_VERSION_NUMBER < 10
#error "ESVR needs OpenVDB 10 or newer"
#endif

// The headers of NanoVDB's writers for `#include ESVR_NANOVDB_...`, their namespace, whether they
// contain createNanoGrid(), and the function that gives the GridType of a type of values.
#if __has_include(<nanovdb/io/IO.h>)  // OpenVDB 12 and up
#define ESVR_NANOVDB_IO <nanovdb/io/IO.h>
#define ESVR_NANOVDB_CREATE <nanovdb/tools/CreateNanoGrid.h>
#define ESVR_NANOVDB_HAS_CREATE
#define ESVR_NANOVDB_GRID_TYPE toGridType
namespace nanovdb::tools {}
namespace esvr::vdb {
namespace nanotools = nanovdb::tools;
}
#else
#define ESVR_NANOVDB_IO <nanovdb/util/IO.h>
#define ESVR_NANOVDB_GRID_TYPE mapToGridType
#if __has_include(<nanovdb/util/CreateNanoGrid.h>)  // OpenVDB 11
#define ESVR_NANOVDB_CREATE <nanovdb/util/CreateNanoGrid.h>
#define ESVR_NANOVDB_HAS_CREATE
#else
#define ESVR_NANOVDB_CREATE <nanovdb/util/OpenToNanoVDB.h>
#endif
namespace nanovdb {}
namespace esvr::vdb {
namespace nanotools = nanovdb;
}
#endif

namespace esvr::vdb {

/// Registers OpenVDB's types. It is cheap after the first call and safe to call from any thread.
void initializeOpenVdb();

/// The oldest file format that can be read, that of OpenVDB 1.1 (2013), the first with masks for
/// each node.
inline constexpr std::uint32_t kOldestFileVersion =
    openvdb::OPENVDB_FILE_VERSION_NODE_MASK_COMPRESSION;

/// The newest file format whose bytes are known. Format 225 of OpenVDB 13 has one more type of grids
/// than format 224, and stores all others in the same way, so that older versions of OpenVDB can read
/// and write their bytes.
inline constexpr std::uint32_t kNewestFileVersion =
    std::max<std::uint32_t>(225, openvdb::OPENVDB_FILE_VERSION);

}  // namespace esvr::vdb
