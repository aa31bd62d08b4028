// Chooses grids of the input, reads them, and measures their conversions.
#include "vdb2esvr/convert.h"

#include <algorithm>
#include <set>
#include <utility>

#include "esvr/grid_coding.h"
#include "programs/run_main.h"

namespace esvr::vdb2esvr {

// Choosing.

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

// Reading.

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

FileSource sourceOf(const Options& options, const VdbSummary& input, const GridChoice& choice) {
  FileChoice places;
  for (const FittedGrid& grid : choice.fitted)
    if (grid.component.value_or(0) == 0) places.converted.push_back(grid.place);
  for (const NotFitted& grid : choice.carried) places.carried.push_back(grid.place);
  FileSource source = readSources(options.input, input, places, options.read);
  for (std::size_t g = 0; g < choice.fitted.size(); ++g)
    source.grids[g].goal = ownGoalOf(options, choice.fitted[g]);
  return source;
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

// Measuring.

namespace {

/// Largest number of voxels in bricks up to which the meshes of a level set are compared without
/// being asked for. Comparing them takes about 2 s per million of these voxels.
constexpr std::size_t kMaxMeshedVoxels = std::size_t{1} << 19;

std::optional<SurfaceErrors> surfaceErrors(const VolumeGrid& source, const VolumeGrid& decoded) {
  if (!isNarrowBand(source.descriptor, source.volume)) return std::nullopt;
  if (hasNonFinite(source.volume)) {  // no surface passes where there is no distance
    VolumeGrid a = source, b = decoded;
    dropNonFinite(a.volume);
    dropNonFinite(b.volume);
    return surfaceErrors(a, b);
  }
  SurfaceErrors errors{compareSigns(source.volume, decoded.volume)};
  if (source.volume.values.size() <= kMaxMeshedVoxels)
    errors.distance = meshDistance(source, decoded);
  return errors;
}

bool isEmpty(const SparseVolume& volume, const Box& box) {
  for (std::size_t b = 0; b < volume.brickCount(); ++b) {
    bool isFound = false;
    forEachActive(volume.active[b], [&](int v) {
      isFound = isFound || box.contains(volume.brickCorner(b) + voxelLocal(v));
    });
    if (isFound) return false;
  }
  return true;
}

/// The errors that a summary needs.
VolumeGrid measureValues(const Options& options, const VolumeGrid& source, ConvertedGrid& grid) {
  const CommonFitOptions& fit = options.convert.fit;
  VolumeGrid decoded{.descriptor = source.descriptor,
                     .volume = decodeGrid(grid.stored(), {.memory = memoryOf(source.volume)})};
  const Narrowing& narrowing = source.narrowing;
  if (narrowing.max > narrowing.min)
    grid.narrowingOfRange = narrowing.largest() / (narrowing.max - narrowing.min);
  grid.isBoxEmpty = fit.box && isEmpty(source.volume, *fit.box);
  const bool isLight =
      !grid.id.component && isLookedThrough(source.descriptor.gridClass, source.volume);
  grid.metrics = compareVolumes(source.volume, decoded.volume,
                                {.box = fit.box,
                                 .peak = grid.key.peak,
                                 .transmittance = isLight,
                                 .narrowing = source.narrowing});
  return decoded;
}

void measureAll(const Options& options, const VolumeGrid& source, ConvertedGrid& grid) {
  const VolumeGrid decoded = measureValues(options, source, grid);
  grid.surface = surfaceErrors(source, decoded);
  if (source.descriptor.gridClass == GridClass::kLevelSet)
    grid.whyNoNarrowBand = whyNoNarrowBand(source.descriptor, source.volume);
}

/// Measures a conversion. If that is cancelled, the values only.
void measure(const Options& options, const VolumeGrid& source, ConvertedGrid& grid) {
  try {
    CancelScope::check();
    return measureAll(options, source, grid);
  } catch (const Cancelled&) {
  }
  const BestSoFar completion;
  (void)measureValues(options, source, grid);
}

}  // namespace

ConvertedGrid measured(const Options& options, const FittedGrid& fitted, const VolumeGrid& source,
                       const GridConversion& made, const Device& device) {
  ConvertedGrid grid;
  static_cast<GridConversion&>(grid) = made;
  grid.uniqueName = fitted.uniqueName;
  grid.sourceName = fitted.source.uniqueName;
  grid.id = {fitted.place, fitted.component};
  grid.wantedPsnr = wantedPsnrOf(options, fitted);
  grid.device = deviceName(device);
  const FitResult& fit = made.conversion.fit;
  grid.seconds = {made.secondsRead, fit.secondsSeed, fit.secondsOptimise, 0.0, 0.0};
  grid.seconds.encode = made.secondsConvert - grid.seconds.fit();
  if (options.onlyFits) return grid;
  cli::Stopwatch watch;
  measure(options, source, grid);
  grid.seconds.measure = watch.lap();
  return grid;
}

VectorMetrics measureVector(const Options& options, const EsvrFile& file,
                            const StoredVector& vector, std::size_t place) {
  const VectorGrid source = readVector(options.input, place, options.read);
  const VectorGrid decoded =
      decodeVector(vector.name, componentsOf(file, vector), {.memory = options.read.memory});
  return compareVectors(source.components, decoded.components, {.box = options.convert.fit.box},
                        source.narrowing);
}

}  // namespace esvr::vdb2esvr
