// Reads, converts and measures grids of the input.
#include "vdb2esvr/convert.h"

#include <algorithm>
#include <utility>
#include <variant>

#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"
#include "programs/messages.h"
#include "programs/run_main.h"

namespace esvr::vdb2esvr {

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

// Converting.

const StoredGrid* previousOf(const Options& options, const FittedGrid& fitted) {
  if (!options.previous) return nullptr;
  const std::string name = fitted.storedName();
  std::size_t before = 0;
  for (const StoredGrid& grid : options.previous->grids)
    if (grid.descriptor.name == name && before++ == fitted.number) return &grid;
  return nullptr;
}

SourceKey sourceKeyOf(const Options& options, const FittedGrid& fitted, const VolumeGrid& source) {
  return {keyOf({source.descriptor, source.volume}), fitted.peak, fitted.range,
          ownGoalOf(options, fitted)};
}

namespace {

/// The same grid of the previous frame, if it was made from the same source.
const StoredGrid* asBefore(const Options& options, const FittedGrid& fitted,
                           const VolumeGrid& source, const SourceKey& key) {
  const StoredGrid* const before = previousOf(options, fitted);
  const auto keyBefore = options.previousSources->find(fitted.uniqueName);
  const bool isSame = before != nullptr && keyBefore != options.previousSources->end() &&
                      keyBefore->second == key &&
                      before->descriptor.valueType == source.descriptor.valueType;
  return isSame ? before : nullptr;
}

void convertByPaper(const Options& options, const VolumeGrid& source, ConvertedGrid& grid) {
  const ConvertOptions& convert = options.convert;
  PaperConversion made = esvr::convertByPaper({source.descriptor, source.volume},
                                              {convert.fit, *options.paper}, convert.storage);
  grid.conversion = std::move(made.conversion);
  grid.paper = std::move(made.record);
}

/// The goal of a grid. A bound in % of the range of vectors is the same for all components.
Goal resolvedGoal(const Options& options, const FittedGrid& fitted) {
  Goal goal = goalOf(options, fitted);
  if (auto* within = std::get_if<BoundGoal>(&goal); within && within->relative && fitted.range)
    *within = {within->bound * *fitted.range, false};
  return goal;
}

/// What a grid is converted to.
struct Wish {
  std::optional<std::uint64_t> bytes;  ///< that it may add
  const StoredGrid* previous;          ///< ConvertOptions::previous
};

void convert(const Options& options, const VolumeGrid& source, const Wish& wish,
             ConvertedGrid& grid) {
  if (options.paper) return convertByPaper(options, source, grid);
  ConvertOptions wanted = options.convert;
  wanted.previous = wish.previous;
  if (wish.bytes) wanted.goal = SizeGoal{*wish.bytes};
  if (grid.id.component) wanted.measure = Measure::kValues;
  // The parts of a single fit do not depend on the storage, and compact storage takes time.
  if (options.onlyFits && std::holds_alternative<FitGoal>(wanted.goal))
    wanted.storage.form = Storage::kFloat32;
  grid.conversion = convertVolume({source.descriptor, source.volume}, wanted);
}

/// Largest number of voxels in bricks up to which the meshes of a level set are compared without
/// being asked for. Comparing them takes about 2 s per million of these voxels.
constexpr std::size_t kMaxMeshedVoxels = std::size_t{1} << 19;

std::optional<SurfaceErrors> surfaceErrors(const VolumeGrid& source, const VolumeGrid& decoded) {
  if (!isNarrowBand(source.descriptor, source.volume)) return std::nullopt;
  SurfaceErrors errors{compareSigns(source.volume, decoded.volume)};
  if (source.volume.values.size() <= kMaxMeshedVoxels)
    errors.distance = meshDistance(source, decoded);
  return errors;
}

/// A converted grid that has its names only.
ConvertedGrid named(const FittedGrid& fitted) {
  ConvertedGrid grid;
  grid.uniqueName = fitted.uniqueName;
  grid.sourceName = fitted.source.uniqueName;
  grid.id = fitted.id();
  return grid;
}

/// The errors that a summary needs.
VolumeGrid measureValues(const Options& options, const VolumeGrid& source, ConvertedGrid& grid) {
  const CommonFitOptions& fit = options.convert.fit;
  VolumeGrid decoded{.descriptor = source.descriptor,
                     .volume = decodeGrid(grid.stored(), {.memory = memoryOf(source.volume)})};
  const bool isLight =
      !grid.id.component && isLookedThrough(source.descriptor.gridClass, source.volume);
  grid.metrics = compareVolumes(source.volume, decoded.volume,
                                {.box = fit.box, .peak = fit.peak, .transmittance = isLight});
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

ConvertedGrid readAndConvert(const Options& given, const FittedGrid& fitted,
                             std::optional<std::uint64_t> bytes, const StoredGrid* expected) {
  Options options = given;
  options.convert.goal = resolvedGoal(given, fitted);
  CommonFitOptions& fit = options.convert.fit;
  fit.peak = fitted.peak;
  ConvertedGrid grid = named(fitted);
  grid.wantedPsnr = wantedPsnrOf(given, fitted);
  cli::Stopwatch watch;
  const VolumeGrid source = readSource(options, fitted);
  grid.bricks = source.volume.brickCount();
  grid.nonFiniteReplaced = source.nonFiniteReplaced;
  grid.inactive = source.inactive;
  grid.seconds.read = watch.lap();

  grid.device = deviceName(fit.device);
  const StoredGrid* before = nullptr;
  if (options.previousSources != nullptr) {
    grid.source = sourceKeyOf(options, fitted, source);
    before = asBefore(options, fitted, source, *grid.source);
  }
  if (before != nullptr) {
    grid.asBefore = true;
    grid.conversion.grid = *before;
    grid.conversion.grid.descriptor = source.descriptor;
    grid.conversion.grid.reference.reset();  // it may name another grid of this file
  } else {
    convert(options, source, {bytes, expected ? expected : previousOf(options, fitted)}, grid);
  }
  grid.seconds.seed = grid.conversion.fit.secondsSeed;
  grid.seconds.optimise = grid.conversion.fit.secondsOptimise;
  grid.seconds.encode = watch.lap() - grid.seconds.fit();
  if (options.onlyFits) return grid;

  measure(options, source, grid);
  grid.seconds.measure = watch.lap();
  return grid;
}

}  // namespace

ConvertedGrid convertGrid(const Options& options, const FittedGrid& fitted,
                          std::optional<std::uint64_t> bytes, const StoredGrid* expected) {
  return sayingTheWayOut(fitted, [&] { return readAndConvert(options, fitted, bytes, expected); });
}

ConvertedGrid twinOf(const ConvertedGrid& grid, const FittedGrid& fitted, const Twin& twin) {
  ConvertedGrid made = grid;
  made.uniqueName = fitted.uniqueName;
  made.sourceName = fitted.source.uniqueName;
  made.id = fitted.id();
  made.conversion.grid.descriptor = twin.descriptor;
  made.nonFiniteReplaced = twin.nonFiniteReplaced;
  made.twinOf = grid.id;
  made.inactive = twin.inactive;
  made.sameAs = grid.uniqueName;
  made.seconds = {.read = twin.secondsRead};
  return made;
}

}  // namespace esvr::vdb2esvr
