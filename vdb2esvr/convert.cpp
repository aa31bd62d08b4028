#include "vdb2esvr/convert.h"

#include <algorithm>
#include <utility>
#include <variant>

#include "cli/stopwatch.h"
#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "vdb2esvr/source.h"

namespace esvr::vdb2esvr {
namespace {

void convertByPaper(const Options& options, const VolumeGrid& source, ConvertedGrid& grid) {
  const ConvertOptions& convert = options.convert;
  PaperConversion made = esvr::convertByPaper({source.descriptor, source.volume},
                                              {convert.fit, *options.paper}, convert.storage);
  grid.conversion = std::move(made.conversion);
  grid.paper = std::move(made.record);
}

/// The same grid of the previous frame, which is the one with its number among those that are stored by
/// its name; null if there is none.
const StoredGrid* previousOf(const Options& options, const FittedGrid& fitted) {
  if (!options.previous) return nullptr;
  const std::string name = fitted.storedName();
  std::size_t before = 0;
  for (const StoredGrid& grid : options.previous->grids)
    if (grid.descriptor.name == name && before++ == fitted.number) return &grid;
  return nullptr;
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
  grid.metrics = compareVolumes(source.volume, decoded.volume, {.box = fit.box, .peak = fit.peak});
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
  convert(options, source, {bytes, expected ? expected : previousOf(options, fitted)}, grid);
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
