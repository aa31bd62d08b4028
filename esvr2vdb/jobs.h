#pragma once
/// The jobs of esvr2vdb. Each throws esvr::Error where it cannot be done.

#include "esvr2vdb/options.h"

namespace esvr::esvr2vdb {

/// Writes the VDB; with a reference, prints how far the written grids are from it.
void convert(const Options& options);

/// Prints the grids of a file, and of an .esvr its sections. No voxel is evaluated.
void list(const Options& options);

/// Prints the grids of a .vdb or .nvdb.
void listVdb(const Options& options);

/// Reads everything and prints OK. \throws BadInput  the file is damaged (says where)
void check(const Options& options);

}  // namespace esvr::esvr2vdb
