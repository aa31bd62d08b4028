#pragma once
/// Names of grids and of their classes. Users give names to find the grids of a file; several grids
/// may share a name or have none.

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "esvr/grid_descriptor.h"

namespace esvr {

/// OpenVDB's names: "level set", "fog volume", "staggered", "unknown".
[[nodiscard]] const char* className(GridClass gridClass);

/// The names that --grid takes: each grid's name, with "[i]" (i from 0, in file order) if several
/// grids share it.
/// \param names  names of the grids, in file order
[[nodiscard]] std::vector<std::string> uniqueNames(std::span<const std::string> names);

/// Index in `names` of a grid that is given by its unique name, its name (the first grid of that
/// name) or "name[i]".
/// \param file  file name for the error's text; empty if the caller adds it
/// \throws BadInput  there is no such grid; the text lists the grids
[[nodiscard]] std::size_t findGrid(std::span<const std::string> names, const std::string& wanted,
                                   const std::filesystem::path& file = {});

}  // namespace esvr
