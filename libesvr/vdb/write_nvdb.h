#pragma once
/// NanoVDB: where its headers are, how OpenVDB grids become grids of it, and how .nvdb files are written. The
/// conversions are templates that take a minute to compile, so they are in one translation unit.

#include "vdb/open_vdb.h"

#include <filesystem>
#include <span>

#include "esvr/vdb_io.h"

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

// NanoVDB's readers and writers of files are templates that depend on these macros, so every source file
// includes them through this header. Otherwise a program could contain two different definitions of one
// function.
#define NANOVDB_USE_OPENVDB
#define NANOVDB_USE_ZIP
#define NANOVDB_USE_BLOSC
#include ESVR_NANOVDB_IO

namespace esvr::vdb {

using NanoHandle = nanovdb::GridHandle<nanovdb::HostBuffer>;

struct NanoForm {
  NanoValues values = NanoValues::kFloat;
  float tolerance = -1.0f;  ///< for kFpN: largest error in value units; below 0: NanoVDB chooses it
};

/// Converts a grid of floats to a form, or one of doubles or of vectors of floats to the same type, without dithering.
/// \throws std::logic_error  the grid has another type, or is not one of floats and the form is not
///                           kFloat
[[nodiscard]] NanoHandle makeNano(const openvdb::GridBase& grid, const NanoForm& form = {});

/// Implements writeGrids for .nvdb files. Writes to an existing empty file.
/// \throws UsageError  NanoVDB cannot hold the grid
/// \throws std::ios_base::failure  the disk is full
void writeNanoVdb(const std::filesystem::path& path, std::span<const GridToWrite> grids,
                  const WriteOptions& options);

}  // namespace esvr::vdb
