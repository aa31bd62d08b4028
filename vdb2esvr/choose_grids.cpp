#include "vdb2esvr/choose_grids.h"

#include <set>

#include "esvr/error.h"
#include "esvr/grid_names.h"

namespace esvr::vdb2esvr {
namespace {

GridChoice allThatCanBeFitted(const std::filesystem::path& file, const VdbSummary& summary) {
  GridChoice choice;
  for (const auto& grid : summary.grids)
    (grid.skipReason.empty() ? choice.fitted : choice.skipped).push_back(grid);
  if (!choice.fitted.empty()) return choice;
  std::string text = file.string() + ": the file has no grid that can be fitted";
  for (const auto& grid : choice.skipped)
    text += "\n  grid \"" + grid.uniqueName + "\": " + grid.skipReason;
  throw BadInput(text);
}

GridChoice named(const std::filesystem::path& file, const VdbSummary& summary,
                 const std::vector<std::string>& names) {
  std::vector<std::string> stored;
  for (const auto& grid : summary.grids) stored.push_back(grid.name);
  std::set<std::size_t> places;  // a set, so that a grid that is named twice is fitted once
  for (const auto& name : names) places.insert(findGrid(stored, name, file));
  GridChoice choice;
  for (const std::size_t i : places) {
    const GridSummary& grid = summary.grids[i];
    if (!grid.skipReason.empty())
      throw BadInput(file.string() + ": grid \"" + grid.uniqueName + "\": " + grid.skipReason);
    choice.fitted.push_back(grid);
  }
  return choice;
}

}  // namespace

GridChoice chooseGrids(const std::filesystem::path& file, const VdbSummary& summary,
                       const std::vector<std::string>& names) {
  if (names.empty()) return allThatCanBeFitted(file, summary);
  return named(file, summary, names);
}

}  // namespace esvr::vdb2esvr
