#pragma once
/// Chooses grids of an .esvr file by name.

#include <filesystem>
#include <string>
#include <vector>

#include "esvr/container.h"

namespace esvr::esvr2vdb {

/// A grid of a file and the name that --grid takes: the name of the grid, with "[i]" if several
/// grids of the file have it.
struct NamedGrid {
  GridOfFile grid;
  std::string name;
};

/// All grids in file order.
[[nodiscard]] std::vector<NamedGrid> namedGrids(const EsvrFile& file);

/// The named grids in file order; all grids if none is named.
/// \param path  file name for error texts
/// \throws BadInput  a grid does not exist; the text lists the grids
[[nodiscard]] std::vector<NamedGrid> chooseGrids(const std::filesystem::path& path,
                                                 const EsvrFile& file,
                                                 const std::vector<std::string>& names);

}  // namespace esvr::esvr2vdb
