#include "esvr2vdb/choose_grids.h"

#include <set>

#include "esvr/grid_names.h"

namespace esvr::esvr2vdb {

std::vector<NamedGrid> namedGrids(const EsvrFile& file) {
  const auto names = uniqueNames(namesInOrder(file));
  std::vector<NamedGrid> grids;
  for (const auto& grid : gridsInOrder(file)) grids.push_back({grid, names[grids.size()]});
  return grids;
}

std::vector<NamedGrid> chooseGrids(const std::filesystem::path& path, const EsvrFile& file,
                                   const std::vector<std::string>& names) {
  const auto all = namedGrids(file);
  if (names.empty()) return all;
  const auto stored = namesInOrder(file);
  std::set<std::size_t> places;  // a set, so that a grid that is named twice is written once
  for (const auto& name : names) places.insert(findGrid(stored, name, path));
  std::vector<NamedGrid> chosen;
  for (const std::size_t place : places) chosen.push_back(all[place]);
  return chosen;
}

}  // namespace esvr::esvr2vdb
