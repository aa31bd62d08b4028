#include "vdb/grid_names.h"

#include "esvr/error.h"
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

void requireGrid(std::size_t place, std::size_t grids) {
  if (place < grids) return;
  throw BadInput("has no grid number " + std::to_string(place + 1) + ", only " +
                 std::to_string(grids) + (grids == 1 ? " grid" : " grids"));
}

std::string notAFloatType(const std::string& valueType) {
  return "its values are of type " + valueType + "; only float, half and double can be fitted";
}

}  // namespace esvr::vdb
