// Splats: writes a grid as splats, and a VDB from splats.
#include "esvr2vdb/jobs.h"

#include <algorithm>
#include <string>
#include <vector>

#include "esvr/encode.h"
#include "esvr/error.h"
#include "esvr/splats.h"
#include "programs/files.h"
#include "programs/option_values.h"
#include "programs/run_main.h"
#include "programs/splat_input.h"

namespace esvr::esvr2vdb {
namespace {

/// The index in EsvrFile::grids of the grid that is wanted: by its name, or the first that is called "density", or
/// the first.
std::size_t chooseGrid(const Options& options, const EsvrFile& file) {
  if (options.grids.size() > 1)
    throw UsageError("a file of splats has one grid; name it once with --grid");
  if (!options.grids.empty()) return findStored(file, options.grids.front(), options.input);
  if (file.grids.empty()) throw BadInput(options.input.string() + ": no grid of it has ellipsoids");
  const auto isDensity = [](const StoredGrid& grid) { return grid.descriptor.name == "density"; };
  const auto found = std::ranges::find_if(file.grids, isDensity);
  return found == file.grids.end() ? 0 : std::size_t(found - file.grids.begin());
}

/// The part of a grid that options ask for.
StoredGrid partOf(StoredGrid grid, const Options& options) {
  if (options.part.layers) grid = firstLayers(std::move(grid), *options.part.layers);
  if (options.maxEllipsoids) grid = heaviest(std::move(grid), *options.maxEllipsoids);
  if (options.part.box) grid.activeBox = common(grid.activeBox, *options.part.box);
  return grid;
}

/// The colors over the range of a grid's values and its background, as esvr-render has them.
ColorMap colorsFor(const ColorMap& colors, const StoredGrid& grid) {
  const auto background = float(grid.descriptor.background);
  const ValueRange range{std::min(grid.valueMin, background), std::max(grid.valueMax, background)};
  return rescaled({colors, {{0.0, 1.0}}}, range).colors;
}

void tellWhatIsMissing(const MadeSplats& made, const cli::Log& log) {
  constexpr double kMuch = 1e-3;
  log.detail(cli::counted(made.scene.splats.size(), "splat") + " of " +
             cli::counted(made.ellipsoids, "ellipsoid") + ", with an extinction of " +
             cli::shortNumber(made.scene.densityScale) +
             " for a value of 1 and a unit of the world");
  if (made.negative > 0)
    log.detail(cli::counted(made.negative, "ellipsoid") +
               " of negative values, which splats cannot have, left out");
  if (made.faintShare > kMuch)
    log.warning(
        "a part of the optical depth is left out, because it is too faint for the 8 bits of "
        "formats; a larger --density-scale or fewer ellipsoids keep more of it",
        cli::shortNumber(100.0 * made.faintShare) + " %");
  if (made.clamped > 0)
    log.warning("splats have the smallest or the largest size that formats keep",
                std::to_string(made.clamped));
}

}  // namespace

bool writesSplats(const Options& options) {
  const auto extension = options.output.extension();
  return extension == ".ply" || extension == ".usda";
}

void exportSplats(const Options& options, const EsvrFile& file, const cli::Log& log) {
  const StoredGrid grid = partOf(file.grids[chooseGrid(options, file)], options);
  SplatOptions wanted = options.splats.made;
  wanted.colors = colorsFor(wanted.colors, grid);
  wanted.maxBytes = options.memory.maxBytes;
  if (options.output.extension() == ".usda") wanted.form = SplatForm::kUsd;
  const MadeSplats made = makeSplats(grid, wanted);
  tellWhatIsMissing(made, log);
  writeSplats(options.output, made.scene, wanted.form, options.write.overwrite);
}

void importSplats(const Options& options) {
  const cli::Interrupts interrupts;
  const cli::Log log(kProgram, options.verbosity);
  cli::requireSeparate(options.inputs.paths, {options.output});
  cli::checkOutput(options.output, {".vdb", ".nvdb"}, options.write.overwrite);
  const cli::WatchedInputs watched({options.input});
  const SplatGrids grids =
      cli::readSplatGrids(options.input, options.splats.read, options.memory, log);
  std::vector<GridToWrite> written{&grids.density};
  const bool isNano = options.output.extension() == ".nvdb";
  if (grids.color && !isNano) written.emplace_back(&*grids.color);
  if (grids.color && isNano)
    log.warning("the colors are left out: vectors are not written to NanoVDB files");
  watched.requireUnchanged();
  namingFile(options.input.string(),
             [&] { writeGrids(options.output, {}, written, options.write); });
}

}  // namespace esvr::esvr2vdb
