#pragma once
/// The names of a file's grids, and the reasons why grids are skipped.

#include <string>
#include <vector>

#include "esvr/vdb_io.h"

namespace esvr::vdb {

/// Sets the uniqueName of every grid.
void assignUniqueNames(std::vector<GridSummary>& grids);

/// \throws BadInput  the file has no grid at this place
void requireGrid(std::size_t place, std::size_t grids);

/// The reason, for the user, why a grid of this type is skipped.
std::string notAFloatType(const std::string& valueType);

}  // namespace esvr::vdb
