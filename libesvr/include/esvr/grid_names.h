#pragma once
/// A file's grids by the names a user gives them. Several grids may share a name, or have none.

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace esvr {

/// The name that --grid takes for each grid: its own, with "[i]" (from 0, in file order) where
/// several share it. \param names  of the grids, in file order
[[nodiscard]] std::vector<std::string> uniqueNames(std::span<const std::string> names);

/// Place in `names` of the grid asked for: by its unique name, by its name (the first so called) or
/// as "name[i]".
/// \param file  for the error; empty where the caller names it
/// \throws BadInput  no such grid; the text lists those there are
[[nodiscard]] std::size_t findGrid(std::span<const std::string> names, const std::string& wanted,
                                   const std::filesystem::path& file = {});

}  // namespace esvr
