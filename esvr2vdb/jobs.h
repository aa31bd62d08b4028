#pragma once
/// The jobs of esvr2vdb. Each throws an esvr::Error if it fails.

#include "esvr2vdb/options.h"

namespace esvr::esvr2vdb {

/// Writes the VDB. If there is a reference, prints the errors of the written grids.
void convert(const Options& options);

/// Prints the grids of a file and, for an .esvr file, its sections. It evaluates no voxel.
void list(const Options& options);

/// Prints the grids of a .vdb or .nvdb file.
void listVdb(const Options& options);

/// Reads the whole file and prints OK. \throws BadInput  the file is damaged (the text says where)
void check(const Options& options);

}  // namespace esvr::esvr2vdb
