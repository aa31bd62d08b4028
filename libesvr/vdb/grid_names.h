#pragma once
/// A file's list of grids: their names, and why one is passed over.

#include <string>
#include <vector>

#include "esvr/vdb_io.h"

namespace esvr::vdb {

/// Fills in uniqueName.
void assignUniqueNames(std::vector<GridSummary>& grids);

/// Place of the grid asked for. \throws BadInput  none
std::size_t findGrid(const std::vector<GridSummary>& grids, const std::string& wanted);

/// Why a grid of this type is passed over, for the user.
std::string notAFloatType(const std::string& valueType);

}  // namespace esvr::vdb
