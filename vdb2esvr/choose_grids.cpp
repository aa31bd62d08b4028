#include "vdb2esvr/choose_grids.h"

#include <algorithm>
#include <set>
#include <utility>

#include "esvr/convert_file.h"
#include "esvr/error.h"
#include "programs/run_main.h"

namespace esvr::vdb2esvr {
namespace {

using Places = std::set<std::size_t>;  // a set, so that a grid that is named twice counts once

Places placesOf(const std::filesystem::path& file, const GridNames& grids,
                const std::vector<std::string>& names) {
  Places places;
  for (const auto& name : names) places.insert(grids.findWhole(name, file));
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
                          const GridNames& names, const WantedGrids& wanted) {
  WantedPlaces places{placesOf(file, names, wanted.only), placesOf(file, names, wanted.keep),
                      placesOf(file, names, wanted.skip), wanted.only.empty()};
  for (const std::size_t place : places.skip)
    if (places.only.contains(place) || places.keep.contains(place))
      throw UsageError("--skip and " + std::string(places.only.contains(place) ? "-g" : "--keep") +
                       " both name grid \"" + summary.grids[place].uniqueName + '"');
  return places;
}

/// The reason why a grid is not fitted; empty if it is.
std::string whyNotFitted(const GridSummary& grid, bool isKept, bool lossless) {
  return isKept ? "--keep names it" : whyCarried(grid, lossless);
}

void addFitted(const GridSummary& grid, std::size_t place, const GridNames& names,
               std::vector<FittedGrid>& fitted) {
  if (!grid.isVector) return fitted.push_back({grid, place, std::nullopt, names.unique(place)});
  for (std::size_t c = 0; c < kComponents; ++c)
    fitted.push_back({grid, place, c, names.ofComponent(place, c)});
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
  if (choice.fitted.empty() && choice.carried.empty() && !summary.grids.empty())
    throw BadInput(file.string() + ": all grids of the file are left out");
}

}  // namespace

GridNames namesOf(const VdbSummary& file) {
  std::vector<std::string> names;
  for (const GridSummary& grid : file.grids) names.push_back(grid.name);
  return GridNames(std::move(names));
}

GridChoice chooseGrids(const std::filesystem::path& file, const VdbSummary& summary,
                       const WantedGrids& wanted) {
  const GridNames names = namesOf(summary);
  const WantedPlaces places = wantedPlaces(file, summary, names, wanted);
  GridChoice choice;
  for (std::size_t i = 0; i < summary.grids.size(); ++i) {
    const GridSummary& grid = summary.grids[i];
    const std::string why = whyNotFitted(grid, places.keep.contains(i), wanted.lossless);
    if (places.skip.contains(i))
      choice.skipped.push_back({grid, i, "--skip names it"});
    else if (places.wants(i) && why.empty())
      addFitted(grid, i, names, choice.fitted);
    else if (places.wants(i))
      choice.carried.push_back({grid, i, why});
  }
  refuseLostGrids(file, choice.carried);
  refuseNothing(file, summary, choice);
  return choice;
}

}  // namespace esvr::vdb2esvr
