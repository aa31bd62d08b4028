#include "vdb2esvr/source.h"

#include <algorithm>

#include "cli/shell_word.h"
#include "esvr/vector_metrics.h"

namespace esvr::vdb2esvr {
namespace {

/// The inactive values of a grid that a converted grid loses, over all components of vectors.
InactiveValues inactiveValuesOf(const Options& options, const FittedGrid& grid) {
  return sayingTheWayOut(grid, [&] {
    return grid.component ? readVector(options.input, grid.place, options.read).inactive
                          : readGrid(options.input, grid.place, options.read).inactive;
  });
}

/// Carries a grid instead of fitting it.
void carry(const FittedGrid& grid, const std::string& why, GridChoice& choice) {
  const auto at = std::ranges::upper_bound(choice.carried, grid.place, {}, &NotFitted::place);
  choice.carried.insert(at, {grid.source, grid.place, why});
  std::erase_if(choice.fitted, [place = grid.place](const auto& g) { return g.place == place; });
}

}  // namespace

VolumeGrid readSource(const Options& options, const FittedGrid& grid) {
  return grid.component ? readComponent(options.input, grid.place, *grid.component, options.read)
                        : readGrid(options.input, grid.place, options.read);
}

void findScales(const Options& options, std::vector<FittedGrid>& grids) {
  for (std::size_t g = 0; g < grids.size(); ++g) {
    if (!grids[g].component) continue;
    if (grids[g].component != std::size_t{0}) {
      grids[g].peak = grids[g - 1].peak, grids[g].range = grids[g - 1].range;
      continue;
    }
    const VectorGrid vectors = sayingTheWayOut(
        grids[g], [&] { return readVector(options.input, grids[g].place, options.read); });
    grids[g].peak = peakOfVectors(vectors.components);
    grids[g].range = valueRangeOfVectors(vectors.components);
  }
}

void carryInactiveValues(const Options& options, const std::function<void(std::string)>& warn,
                         GridChoice& choice) {
  if (!options.grids.lossless) return;
  const std::vector<FittedGrid> fitted = choice.fitted;
  for (const FittedGrid& grid : fitted) {
    if (grid.component.value_or(0) != 0) continue;
    const InactiveValues inactive = inactiveValuesOf(options, grid);
    if (inactive.count() == 0) continue;
    if (grid.source.whyNotCarried.empty())
      carry(grid, "it has " + toText(inactive) + ", which only a carried grid keeps", choice);
    else
      warn("grid \"" + grid.source.uniqueName + "\" loses " + toText(inactive) + ", because " +
           grid.source.whyNotCarried);
  }
}

std::string wayOut(const GridSummary& grid) {
  const std::string name = cli::shellWord(grid.uniqueName);
  if (grid.whyNotCarried.empty())
    return " --keep " + name + " carries the grid unchanged, bit for bit";
  return " --skip " + name + " leaves the grid out";
}

}  // namespace esvr::vdb2esvr
