#include "esvr2vdb/choose_grids.h"

#include <numeric>
#include <set>

#include "esvr/grid_names.h"

namespace esvr::esvr2vdb {
namespace {

std::vector<std::string> storedNames(const EsvrFile& file) {
  std::vector<std::string> names;
  for (const auto& grid : file.grids) names.push_back(grid.descriptor.name);
  return names;
}

}  // namespace

std::vector<std::string> uniqueNames(const EsvrFile& file) {
  return esvr::uniqueNames(storedNames(file));
}

std::vector<std::size_t> chooseGrids(const std::filesystem::path& path, const EsvrFile& file,
                                     const std::vector<std::string>& names) {
  std::vector<std::size_t> places(file.grids.size());
  std::iota(places.begin(), places.end(), std::size_t{0});
  if (names.empty()) return places;
  const auto stored = storedNames(file);
  std::set<std::size_t> chosen;  // a set, so that a grid that is named twice is written once
  for (const auto& name : names) chosen.insert(findGrid(stored, name, path));
  return {chosen.begin(), chosen.end()};
}

}  // namespace esvr::esvr2vdb
