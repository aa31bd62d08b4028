#pragma once
/// The option --reference.

#include <array>
#include <cstddef>
#include <iosfwd>
#include <string>
#include <vector>

#include "esvr/vector_grid.h"
#include "esvr2vdb/options.h"

namespace esvr::esvr2vdb {

/// A written grid and the grid of the reference that it is compared with.
struct ComparedGrid {
  std::string name;                                   ///< name in the .esvr file
  std::array<std::string, kComponents> components{};  ///< their names, for vectors
  std::size_t reference = 0;                          ///< place in the reference
  std::size_t written = 0;                            ///< place in the output
  bool isVector = false;
};

/// Compares the written grids with the reference and prints a table.
/// \throws BadInput, MemoryExceeded  as for readGrid
void printErrors(const Options& options, const std::vector<ComparedGrid>& grids, std::ostream& out);

}  // namespace esvr::esvr2vdb
