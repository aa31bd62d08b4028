#include "esvr2vdb/choose_grids.h"

#include <set>

#include "esvr/grid_names.h"

namespace esvr::esvr2vdb {

std::vector<ListedGrid> listedGrids(const EsvrFile& file) {
  const GridNames names(namesInOrder(file));
  std::vector<ListedGrid> grids;
  for (const auto& grid : gridsInOrder(file))
    grids.push_back({grid, names.unique(grids.size()), grids.size()});
  return grids;
}

std::vector<ListedGrid> chooseGrids(const std::filesystem::path& path, const EsvrFile& file,
                                    const std::vector<std::string>& wanted) {
  const auto all = listedGrids(file);
  if (wanted.empty()) return all;
  const GridNames names(namesInOrder(file));
  std::set<std::size_t> places;  // a set, so that a grid that is named twice is written once
  for (const auto& name : wanted) places.insert(names.findWhole(name, path));
  std::vector<ListedGrid> chosen;
  for (const std::size_t place : places) chosen.push_back(all[place]);
  return chosen;
}

}  // namespace esvr::esvr2vdb
