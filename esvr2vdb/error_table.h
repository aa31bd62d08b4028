#pragma once
/// --reference.

#include <iosfwd>
#include <string>
#include <vector>

#include "esvr2vdb/options.h"

namespace esvr::esvr2vdb {

/// A written grid and its counterpart in the reference.
struct ComparedGrid {
  std::string name;         ///< in the reference
  std::string writtenName;  ///< in the output
};

/// Compares what was written with the reference, grid by grid, and prints a table.
/// \throws BadInput  a grid is not in the reference
void printErrors(const Options& options, const std::vector<ComparedGrid>& grids, std::ostream& out);

}  // namespace esvr::esvr2vdb
