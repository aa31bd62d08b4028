#include "vdb2esvr/choose_grids.h"

#include <algorithm>
#include <set>

#include "cli/shell_word.h"
#include "esvr/error.h"
#include "esvr/grid_names.h"

namespace esvr::vdb2esvr {
namespace {

using Places = std::set<std::size_t>;  // a set, so that a grid that is named twice counts once

Places placesOf(const std::filesystem::path& file, const VdbSummary& summary,
                const std::vector<std::string>& names) {
  std::vector<std::string> stored;
  for (const auto& grid : summary.grids) stored.push_back(grid.name);
  Places places;
  for (const auto& name : names) places.insert(findGrid(stored, name, file));
  return places;
}

/// The named places in a file.
struct WantedPlaces {
  Places only, keep, skip;
  bool all = false;  ///< whether no grid is named by --grid

  [[nodiscard]] bool wants(std::size_t place) const {
    return all || only.contains(place) || keep.contains(place);
  }
};

WantedPlaces wantedPlaces(const std::filesystem::path& file, const VdbSummary& summary,
                          const WantedGrids& wanted) {
  WantedPlaces places{placesOf(file, summary, wanted.only), placesOf(file, summary, wanted.keep),
                      placesOf(file, summary, wanted.skip), wanted.only.empty()};
  for (const std::size_t place : places.skip)
    if (places.only.contains(place) || places.keep.contains(place))
      throw UsageError("--skip and " + std::string(places.only.contains(place) ? "-g" : "--keep") +
                       " both name grid \"" + summary.grids[place].uniqueName + '"');
  return places;
}

/// The reason why a grid is not fitted; empty if it is.
std::string whyCarried(const GridSummary& grid, bool isKept, bool lossless) {
  if (isKept) return "--keep names it";
  if (!grid.skipReason.empty() && !grid.isVector) return grid.skipReason;
  const bool isDouble = grid.valueType == "double" || grid.valueType == "vec3d";
  return lossless && isDouble && grid.whyNotCarried.empty()
             ? "its values are doubles, which a lossless file cannot hold in another way"
             : "";
}

void addFitted(const GridSummary& grid, std::size_t place, std::vector<FittedGrid>& fitted) {
  if (!grid.isVector) return fitted.push_back({grid, place});
  for (std::size_t c = 0; c < kComponents; ++c) fitted.push_back({grid, place, c});
}

void refuseLostGrids(const std::filesystem::path& file, const std::vector<NotFitted>& carried) {
  std::string text, skips;
  for (const auto& [grid, place, why] : carried) {
    if (grid.whyNotCarried.empty()) continue;
    text += "\n  grid \"" + grid.uniqueName + "\" can be neither fitted (" + why +
            ") nor carried (" + grid.whyNotCarried + ')';
    skips += " --skip " + cli::shellWord(grid.uniqueName);
  }
  if (!text.empty())
    throw BadInput(file.string() + ": grids would be lost unless they are left out by" + skips +
                   text);
}

void refuseNothing(const std::filesystem::path& file, const VdbSummary& summary,
                   const GridChoice& choice) {
  if (!choice.fitted.empty() || !choice.carried.empty()) return;
  throw BadInput(file.string() + (summary.grids.empty() ? ": the file has no grid"
                                                        : ": all grids of the file are left out"));
}

}  // namespace

std::string FittedGrid::uniqueName() const {
  return component ? componentName(source.uniqueName, *component) : source.uniqueName;
}

GridChoice chooseGrids(const std::filesystem::path& file, const VdbSummary& summary,
                       const WantedGrids& wanted) {
  const WantedPlaces places = wantedPlaces(file, summary, wanted);
  GridChoice choice;
  for (std::size_t i = 0; i < summary.grids.size(); ++i) {
    const GridSummary& grid = summary.grids[i];
    const std::string why = whyCarried(grid, places.keep.contains(i), wanted.lossless);
    if (places.skip.contains(i))
      choice.skipped.push_back({grid, i, "--skip names it"});
    else if (places.wants(i) && why.empty())
      addFitted(grid, i, choice.fitted);
    else if (places.wants(i))
      choice.carried.push_back({grid, i, why});
  }
  refuseLostGrids(file, choice.carried);
  refuseNothing(file, summary, choice);
  return choice;
}

}  // namespace esvr::vdb2esvr
