#pragma once
/// Compares carried grids of files that were written by different versions of OpenVDB.

#include <vector>

#include "esvr/carried_grid.h"

namespace esvr::test {

/// The grids without the version of their file's format, which is that of the library that wrote the
/// file. The bytes are the same in all versions that are carried.
[[nodiscard]] inline std::vector<CarriedGrid> withoutVersion(std::vector<CarriedGrid> grids) {
  for (CarriedGrid& grid : grids) grid.vdbVersion = 0;
  return grids;
}

}  // namespace esvr::test
