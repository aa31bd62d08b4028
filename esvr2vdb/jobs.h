#pragma once
/// What esvr2vdb does. Each throws esvr::Error where it cannot.

#include "esvr2vdb/options.h"

namespace esvr::esvr2vdb {

/// Writes the VDB; with a reference, prints how far the written grids are from it.
void convert(const Options& options);

/// Prints grids and sections. No voxel is evaluated.
void list(const Options& options);

/// Reads everything and says that it is whole. \throws BadInput  it is not (says where)
void check(const Options& options);

}  // namespace esvr::esvr2vdb
