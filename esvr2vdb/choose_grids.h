#pragma once
/// Chooses grids of an .esvr file by name.

#include <filesystem>
#include <string>
#include <vector>

#include "esvr/container.h"

namespace esvr::esvr2vdb {

/// The names that --grid takes, in file order: the name of the grid, with "[i]" if several grids
/// have it.
[[nodiscard]] std::vector<std::string> uniqueNames(const EsvrFile& file);

/// Indices of the named grids, increasing; of all grids if none is named.
/// \param path  file name for error texts
/// \throws BadInput  a grid does not exist; the text lists the grids
[[nodiscard]] std::vector<std::size_t> chooseGrids(const std::filesystem::path& path,
                                                   const EsvrFile& file,
                                                   const std::vector<std::string>& names);

}  // namespace esvr::esvr2vdb
