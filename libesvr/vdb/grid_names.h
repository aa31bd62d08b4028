#pragma once
/// The names of a file's grids, and the reasons why grids are skipped.

#include <string>
#include <vector>

#include "esvr/vdb_io.h"

namespace esvr::vdb {

/// Sets the uniqueName of every grid.
void assignUniqueNames(std::vector<GridSummary>& grids);

/// Index of a grid by its name. \throws BadInput  there is no such grid
std::size_t findGrid(const std::vector<GridSummary>& grids, const std::string& wanted);

/// The reason, for the user, why a grid of this type is skipped.
std::string notAFloatType(const std::string& valueType);

}  // namespace esvr::vdb
