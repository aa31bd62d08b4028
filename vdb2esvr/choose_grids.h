#pragma once
/// Chooses the grids of a file that are fitted.

#include <string>
#include <vector>

#include "esvr/vdb_io.h"

namespace esvr::vdb2esvr {

struct GridChoice {
  std::vector<GridSummary> fitted;   ///< grids in file order
  std::vector<GridSummary> skipped;  ///< grids that cannot be fitted; empty if grids were named
};

/// \param names  names for --grid; empty: all grids
/// \throws BadInput  a named grid does not exist (the text lists the grids) or cannot be fitted; or
///                   no grid of the file can be fitted
[[nodiscard]] GridChoice chooseGrids(const std::filesystem::path& file, const VdbSummary& summary,
                                     const std::vector<std::string>& names);

}  // namespace esvr::vdb2esvr
