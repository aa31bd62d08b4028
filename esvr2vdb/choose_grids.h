#pragma once
/// Chooses grids of an .esvr file by name.

#include <filesystem>
#include <string>
#include <vector>

#include "esvr/container.h"

namespace esvr::esvr2vdb {

/// A grid of a file and the name that --grid takes (GridNames::unique).
struct ListedGrid {
  GridOfFile grid;
  std::string name;
  std::size_t place = 0;  ///< number of grids before it in the file
};

/// All grids in file order.
[[nodiscard]] std::vector<ListedGrid> listedGrids(const EsvrFile& file);

/// The named grids in file order; all grids if none is named.
/// \param path  file name for error texts
/// \throws BadInput  a grid does not exist, or its name is ambiguous; the text lists the grids
[[nodiscard]] std::vector<ListedGrid> chooseGrids(const std::filesystem::path& path,
                                                  const EsvrFile& file,
                                                  const std::vector<std::string>& wanted);

}  // namespace esvr::esvr2vdb
