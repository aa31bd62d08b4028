#pragma once
/// The one place that knows how OpenVDB 10 to 13 differ, and how NanoVDB's headers moved. Sources
/// of this folder include it before any other header of the two libraries.
///
/// OpenVDB 13 drops delayed loading. Nothing here depends on it: grids are read from a stream of
/// ours (archive.h), which OpenVDB never maps, so voxels are in memory when a read returns.

#include <openvdb/version.h>

#include <cstdint>

#if OPENVDB_LIBRARY_MAJOR_VERSION_NUMBER < 10
#error "ESVR needs OpenVDB 10 or newer"
#endif

// NanoVDB's writers: headers for `#include ESVR_NANOVDB_...`, the namespace they fill, and whether
// createNanoGrid() is among them.
#if __has_include(<nanovdb/io/IO.h>)  // OpenVDB 12 and up
#define ESVR_NANOVDB_IO <nanovdb/io/IO.h>
#define ESVR_NANOVDB_CREATE <nanovdb/tools/CreateNanoGrid.h>
#define ESVR_NANOVDB_HAS_CREATE
namespace nanovdb::tools {}
namespace esvr::vdb {
namespace nanotools = nanovdb::tools;
}
#else
#define ESVR_NANOVDB_IO <nanovdb/util/IO.h>
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

/// Registers OpenVDB's types. Cheap after the first call; safe from any thread.
void initializeOpenVdb();

/// The oldest file format read: that of OpenVDB 1.1 (2013), the first with per-node masks.
inline constexpr std::uint32_t kOldestFileVersion =
    openvdb::OPENVDB_FILE_VERSION_NODE_MASK_COMPRESSION;

}  // namespace esvr::vdb
