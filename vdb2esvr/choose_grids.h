#pragma once
/// Which grids of a file are fitted.

#include <string>
#include <vector>

#include "esvr/vdb_io.h"

namespace esvr::vdb2esvr {

struct GridChoice {
  std::vector<GridSummary> fitted;   ///< in file order
  std::vector<GridSummary> skipped;  ///< with the reason in each; empty where grids were named
};

/// \param names  as --grid takes them; none: all grids
/// \throws BadInput  a named grid is not there (lists those that are) or cannot be fitted, or none
///                   of all grids can
[[nodiscard]] GridChoice chooseGrids(const std::filesystem::path& file, const VdbSummary& summary,
                                     const std::vector<std::string>& names);

}  // namespace esvr::vdb2esvr
