#pragma once
/// The option --reference.

#include <iosfwd>
#include <string>
#include <vector>

#include "esvr2vdb/options.h"

namespace esvr::esvr2vdb {

/// A written grid and the grid of the reference that it is compared with.
struct ComparedGrid {
  std::string name;         ///< name in the reference
  std::string writtenName;  ///< name in the output
  bool isVector = false;
};

/// Compares the written grids with the reference and prints a table.
/// \throws BadInput  a grid is not in the reference
void printErrors(const Options& options, const std::vector<ComparedGrid>& grids, std::ostream& out);

}  // namespace esvr::esvr2vdb
