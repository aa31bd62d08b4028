#pragma once
/// Grids of an .esvr file by the names a user gives them.

#include <filesystem>
#include <string>
#include <vector>

#include "esvr/container.h"

namespace esvr::esvr2vdb {

/// The name that --grid takes for each grid, in file order: its own, with "[i]" where several share
/// it.
[[nodiscard]] std::vector<std::string> uniqueNames(const EsvrFile& file);

/// Places of the named grids in the file, increasing; all of them where none is named.
/// \param path  for errors
/// \throws BadInput  no such grid (lists those there are)
[[nodiscard]] std::vector<std::size_t> chooseGrids(const std::filesystem::path& path,
                                                   const EsvrFile& file,
                                                   const std::vector<std::string>& names);

}  // namespace esvr::esvr2vdb
