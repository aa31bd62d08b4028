#include "vdb/grid_names.h"

#include "esvr/grid_names.h"

namespace esvr::vdb {
namespace {

std::vector<std::string> namesOf(const std::vector<GridSummary>& grids) {
  std::vector<std::string> names;
  for (const auto& grid : grids) names.push_back(grid.name);
  return names;
}

}  // namespace

void assignUniqueNames(std::vector<GridSummary>& grids) {
  const auto unique = uniqueNames(namesOf(grids));
  for (std::size_t i = 0; i < grids.size(); ++i) grids[i].uniqueName = unique[i];
}

std::size_t findGrid(const std::vector<GridSummary>& grids, const std::string& wanted) {
  return esvr::findGrid(namesOf(grids), wanted);
}

std::string notAFloatType(const std::string& valueType) {
  return "its values are of type " + valueType + "; only float, half and double can be fitted";
}

}  // namespace esvr::vdb
