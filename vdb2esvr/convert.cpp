#include "vdb2esvr/convert.h"

#include <utility>

#include "cli/stopwatch.h"
#include "esvr/compact.h"
#include "esvr/grid_coding.h"

namespace esvr::vdb2esvr {
namespace {

/// What a reader gets: through the file's own bytes, so that what is measured is what was stored.
EncodedGrid throughTheFormat(EncodedGrid grid) {
  EsvrFile file;
  file.grids.push_back(std::move(grid));
  const auto bytes = encodeEsvr(file);
  return std::move(decodeEsvr(bytes, "the encoded grid").grids.front());
}

void recordFit(const FitResult& fitted, ConvertedGrid& grid) {
  grid.end = fitted.end;
  grid.pilot = fitted.pilot;
  grid.pairs = fitted.pairs;
  grid.signedIntensities = fitted.signedIntensities;
  grid.seconds.seed = fitted.secondsSeed;
  grid.seconds.pilot = fitted.secondsPilot;
  grid.seconds.optimise = fitted.secondsOptimise;
}

void makeCompact(const Options& options, const SparseVolume& source, EncodedGrid& encoded,
                 ConvertedGrid& grid) {
  CompactResult compact =
      compactGrid(encoded, source,
                  {.loss = options.storageLoss, .psnr = options.fit.psnr, .box = options.fit.box});
  grid.compact = {compact.loss, compact.steps, streamBytes(compact.grid)};
  encoded = std::move(compact.grid);
}

}  // namespace

ConvertedGrid convertGrid(const Options& options, const std::string& uniqueName) {
  ConvertedGrid grid;
  grid.uniqueName = uniqueName;
  cli::Stopwatch watch;
  const VolumeGrid source = readGrid(options.input, uniqueName, options.read);
  grid.bricks = source.volume.brickCount();
  grid.nonFiniteReplaced = source.nonFiniteReplaced;
  grid.seconds.read = watch.lap();

  FitOptions fitOptions = options.fit;
  fitOptions.narrowBand = isNarrowBand(source.descriptor, source.volume);
  FitResult fitted = fit(source.volume, fitOptions);
  recordFit(fitted, grid);
  watch.lap();

  EncodedGrid encoded = encodeGrid(source.descriptor, source.volume, std::move(fitted.field));
  encoded.curve = std::move(fitted.curve);
  if (options.storage == Storage::kCompact) makeCompact(options, source.volume, encoded, grid);
  grid.stored = throughTheFormat(std::move(encoded));
  grid.seconds.encode = watch.lap();

  grid.metrics = compareVolumes(source.volume, decodeGrid(grid.stored), {.box = options.fit.box});
  grid.seconds.measure = watch.lap();
  return grid;
}

}  // namespace esvr::vdb2esvr
