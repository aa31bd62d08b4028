#include "vdb2esvr/convert.h"

#include <utility>
#include <vector>

#include "cli/stopwatch.h"
#include "esvr/compact.h"
#include "esvr/error.h"
#include "esvr/field.h"
#include "esvr/grid_coding.h"
#include "esvr/rate_control.h"
#include "esvr/residual.h"

namespace esvr::vdb2esvr {
namespace {

/// Bytes that a grid adds to a file.
std::uint64_t bytesAdded(const StoredGrid& grid) {
  return encodeEsvr({{}, {grid}}).size() - encodeEsvr({}).size();
}

/// What a reader gets: through the file's own bytes, so that what is measured is what was stored.
StoredGrid throughTheFormat(StoredGrid grid) {
  EsvrFile file;
  file.grids.push_back(std::move(grid));
  const auto bytes = encodeEsvr(file);
  return std::move(decodeEsvr(bytes, "the encoded grid").grids.front());
}

void recordFit(const FitResult& fitted, ConvertedGrid& grid) {
  grid.end = fitted.end;
  grid.kappaLearned = fitted.kappaLearned;
  grid.pairs = fitted.pairs;
  grid.deviceBytes = fitted.deviceBytes;
  grid.signedIntensities = fitted.signedIntensities;
  grid.paper = fitted.paper;
  grid.seconds.seed = fitted.secondsSeed;
  grid.seconds.optimise = fitted.secondsOptimise;
}

void recordCompact(const CompactResult& compact, const StoredGrid& stored, ConvertedGrid& grid) {
  grid.compact = {compact.loss, compact.steps, streamBytes(stored)};
}

/// Count, bits and all else from the size or the PSNR that was asked for.
StoredGrid fitRated(const RateInput& input, std::optional<std::uint64_t> bytes,
                    ConvertedGrid& grid) {
  RatedGrid rated = bytes ? fitToSize(input, *bytes) : fitToPsnr(input, *input.options.psnr);
  recordFit(rated.fit, grid);
  recordCompact(rated.compact, rated.grid, grid);
  grid.curve = std::move(rated.fit.curve);
  return std::move(rated.grid);
}

StoredGrid fitPlain(const RateInput& input, const Options& options, ConvertedGrid& grid) {
  FitResult fitted = fit(input.source, input.options);
  recordFit(fitted, grid);
  StoredGrid encoded =
      makeStoredGrid(input.descriptor, input.source, std::move(fitted.field), input.activity);
  encoded.curve = withoutTimes(fitted.curve);
  grid.curve = std::move(fitted.curve);
  if (options.storage == Storage::kFloat32) return encoded;
  CompactResult compact = compactGrid(encoded, input.source,
                                      {.loss = options.storageLoss,
                                       .psnr = options.fit.psnr,
                                       .box = options.fit.box,
                                       .device = options.fit.device});
  recordCompact(compact, compact.grid, grid);
  return std::move(compact.grid);
}

/// The largest error that was asked for. \throws UsageError  a lossless file of what was rounded
double boundOf(const VoxelDemand& demand, const VolumeGrid& source) {
  if (demand.exact && source.descriptor.valueType == ValueType::kDouble)
    throw UsageError("grid '" + source.descriptor.name +
                     "' is of doubles, which are read as float32: --lossless cannot hold them");
  const ValueRange range = activeRange(source.volume);
  if (!demand.relative) return demand.bound;
  return demand.bound * (double(range.max) - double(range.min));
}

StoredGrid storeVoxels(const VoxelDemand& demand, Activity activity, const VolumeGrid& source) {
  const double bound = boundOf(demand, source);
  VoxelLayer layer = demand.exact || bound == 0.0 ? exactLayer(source.volume)
                                                  : boundedLayer(source.volume, bound, activity);
  return makeStoredVoxels(source.descriptor, source.volume, std::move(layer));
}

/// Voxels alone, or ellipsoids and what they miss: whichever is smaller.
StoredGrid storeBounded(const Options& options, const VolumeGrid& source, ConvertedGrid& grid) {
  StoredGrid voxels = storeVoxels(*options.voxels, options.activity, source);
  const double bound = boundOf(*options.voxels, source);
  if (options.voxels->exact || bound == 0.0 || isNarrowBand(source.descriptor, source.volume))
    return voxels;
  grid.bound = BoundRecord{bytesAdded(voxels), 0};
  if (options.voxels->alone) return voxels;
  BoundedFit fitted = fitWithin({source.descriptor, source.volume, options.fit, options.activity},
                                bound, grid.bound->voxelBytes);
  grid.bound->ellipsoidBytes = fitted.bytes;
  if (!fitted.rated) return voxels;
  recordFit(fitted.rated->fit, grid);
  recordCompact(fitted.rated->compact, fitted.rated->grid, grid);
  return std::move(fitted.rated->grid);
}

/// What is promised is checked on what the file holds.
void checkVoxels(const VoxelDemand& demand, const VolumeGrid& source, const StoredGrid& stored) {
  const double error = largestDifference(source.volume, decodeGrid(stored));
  if (error > boundOf(demand, source))
    throw RuntimeFailure("grid '" + source.descriptor.name + "': an error of " +
                         std::to_string(error) + " is beyond what was asked for");
}

StoredGrid encode(const Options& options, const VolumeGrid& source,
                  std::optional<std::uint64_t> bytes, ConvertedGrid& grid) {
  if (options.voxels) return storeBounded(options, source, grid);
  RateInput input{source.descriptor, source.volume, options.fit, options.activity};
  input.options.narrowBand = isNarrowBand(source.descriptor, source.volume);
  return bytes || searchesForPsnr(options) ? fitRated(input, bytes, grid)
                                           : fitPlain(input, options, grid);
}

void countHits(const SparseVolume& source, ConvertedGrid& grid) {
  std::vector<Coord> corners;
  for (std::size_t b = 0; b < source.brickCount(); ++b) corners.push_back(source.brickCorner(b));
  grid.hits = averageHits(grid.stored.field);
  grid.voxelPairs = esvr::countHits(grid.stored.field, corners).pairs;
}

}  // namespace

ConvertedGrid convertGrid(const Options& options, const std::string& uniqueName,
                          std::optional<std::uint64_t> bytes) {
  ConvertedGrid grid;
  grid.uniqueName = uniqueName;
  cli::Stopwatch watch;
  const VolumeGrid source = readGrid(options.input, uniqueName, options.read);
  grid.bricks = source.volume.brickCount();
  grid.nonFiniteReplaced = source.nonFiniteReplaced;
  grid.seconds.read = watch.lap();

  grid.device = deviceName(options.fit.device);
  grid.stored = throughTheFormat(encode(options, source, bytes, grid));
  if (options.voxels) checkVoxels(*options.voxels, source, grid.stored);
  grid.seconds.encode = watch.lap() - grid.seconds.fit();

  grid.metrics = compareVolumes(source.volume, decodeGrid(grid.stored), {.box = options.fit.box});
  grid.seconds.measure = watch.lap();
  if (options.countHits) countHits(source.volume, grid);
  return grid;
}

}  // namespace esvr::vdb2esvr
