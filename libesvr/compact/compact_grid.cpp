#include "esvr/compact.h"

#include <cmath>
#include <optional>
#include <utility>

#include "compact/choose_steps.h"
#include "compact/measure_layers.h"
#include "esvr/error.h"
#include "esvr/grid.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"

namespace esvr {
namespace {

/// Margin on a wanted PSNR, dB: a reader's sums have another order than the trials' and must still
/// reach it.
constexpr double kPsnrMargin = 5e-4;
/// Up to this PSNR, dB, a reader's PSNR differs from a GPU trial's by less than kPsnrMargin.
constexpr double kMaxPsnrOfMargin = 80.0;

double allowedError(const TrialMaker& maker, const CompactOptions& options) {
  if (options.psnr) return maker.squaresOf(*options.psnr + kPsnrMargin);
  return maker.error() * std::pow(10.0, options.loss / 10.0) + maker.negligibleError();
}

Trial choose(TrialMaker& maker, const CompactOptions& options) {
  if (options.bytes) return chooseStepsFor(maker, *options.bytes);
  return chooseStepsWithin(maker, allowedError(maker, options));
}

/// With a mask or several thresholds, a reader's PSNR differs from that of the trials, which know one
/// threshold. The PSNR of the trials is corrected by what the result misses or exceeds,
/// at most kMaxCorrections times, unless it exceeds the wanted PSNR by kSmallExcess, dB, at most.
constexpr int kMaxCorrections = 2;
constexpr double kSmallExcess = 0.05;

/// What the PSNR of a result exceeds the wanted one by, dB.
double excessOf(const StoredGrid& grid, const SparseVolume& source, const CompactOptions& options) {
  return psnrOverBox(source, decodeGrid(grid, {.memory = memoryOf(source)}),
                     {.box = options.box, .peak = options.peak}) -
         *options.psnr;
}

/// True if a reader does not get the wanted PSNR from the result of a GPU. This may happen near the
/// precision of float32 only.
bool missedByReader(const StoredGrid& grid, const SparseVolume& source,
                    const CompactOptions& options) {
  if (!options.psnr || *options.psnr < kMaxPsnrOfMargin || options.device.kind == DeviceKind::kCpu)
    return false;
  return excessOf(grid, source, options) < 0.0;
}

void requireOneKappa(const StoredGrid& grid) {
  for (const auto& chunk : grid.field.chunks)
    if (!chunk.ellipsoids.kappa.empty())
      throw RuntimeFailure("cannot quantise grid '" + shownName(grid.descriptor.name) +
                           "': its ellipsoids have kappas of their own");
}

}  // namespace

namespace {

/// Renews the rule of a result. \return whether it has changed
bool renewed(const SparseVolume& source, const CompactOptions& options, StoredGrid& grid) {
  if (!options.activity) return false;
  StoredGrid other = grid;
  renewActivity(source, *options.activity, other);
  const bool isSame = other.topology == grid.topology && other.levels == grid.levels &&
                      other.bricks == grid.bricks && other.activeThreshold == grid.activeThreshold;
  if (isSame || (options.bytes && bytesAdded(other) > bytesAdded(grid))) return false;
  grid = std::move(other);
  return true;
}

/// True if a single threshold determines the active voxels.
bool hasOneThreshold(const StoredGrid& grid) {
  return grid.topology == TopologyKind::kThreshold || grid.topology == TopologyKind::kBricks;
}

CompactResult compactOnce(const StoredGrid& grid, const SparseVolume& source,
                          const CompactOptions& options) {
  CompactResult result{grid, {}, 0.0, 0};
  if (grid.field.ellipsoidCount() == 0) return result;
  const Box box = options.box.value_or(activeBox(source));
  TrialMaker maker(withOneThreshold(grid),
                   {.source = source, .box = box, .device = options.device, .peak = options.peak});
  Trial chosen = choose(maker, options);
  // the trials know one threshold, no mask, and no voxels outside the active box that become the background
  const bool sameRule = hasOneThreshold(grid) && common(box, grid.activeBox) == box;
  if (sameRule) result.grid.layerErrors = maker.layerErrors(chosen);
  result.grid.field = std::move(chosen.field);
  result.grid.quantised = std::move(chosen.quantised);
  const bool byValues = !renewed(source, options, result.grid) && sameRule;
  if (!byValues)
    result.grid.layerErrors =
        measureLayers(result.grid, source, {.box = box, .peak = options.peak});
  if (missedByReader(result.grid, source, options)) {
    CompactOptions again = options;
    again.device = {};
    return compactOnce(grid, source, again);
  }
  result.steps = chosen.steps;
  result.bytes = chosen.bytes;
  result.loss = maker.error() > 0.0 ? 10.0 * std::log10(chosen.error / maker.error()) : 0.0;
  return result;
}

/// Looks for a smaller result, or one that reaches the wanted PSNR.
/// \param best  a first result
CompactResult corrected(CompactResult best, const StoredGrid& grid, const SparseVolume& source,
                        const CompactOptions& options) {
  CompactOptions aimed = options;
  double excess = excessOf(best.grid, source, options), last = excess;
  for (int n = 0; n < kMaxCorrections && !(excess >= 0.0 && excess <= kSmallExcess); ++n) {
    *aimed.psnr += 0.5 * kSmallExcess - last;
    CompactResult now = compactOnce(grid, source, aimed);
    last = excessOf(now.grid, source, options);
    const bool better = excess < 0.0 ? last > excess : last >= 0.0 && now.bytes < best.bytes;
    if (better) best = std::move(now), excess = last;
  }
  return best;
}

}  // namespace

namespace {

CompactResult compactQuickly(const StoredGrid& grid, const SparseVolume& source,
                             const CompactOptions& options) {
  CompactResult result{grid, {}, 0.0, 0};
  if (grid.field.ellipsoidCount() == 0) return result;
  TrialMaker maker(withOneThreshold(grid), {.source = source,
                                            .box = options.box.value_or(activeBox(source)),
                                            .device = options.device,
                                            .peak = options.peak,
                                            .quick = true});
  Trial chosen = options.bytes ? firstStepsFor(maker, *options.bytes)
                               : firstStepsWithin(maker, allowedError(maker, options));
  result.loss =
      maker.error() > 0.0 ? 10.0 * std::log10(maker.measure(chosen) / maker.error()) : 0.0;
  result.grid.layerErrors.clear();
  result.grid.field = std::move(chosen.field);
  result.grid.quantised = std::move(chosen.quantised);
  result.steps = chosen.steps;
  result.bytes = chosen.bytes;
  return result;
}

}  // namespace

CompactResult compactGrid(const StoredGrid& grid, const SparseVolume& source,
                          const CompactOptions& options) {
  requireOneKappa(grid);
  if (options.quick) return compactQuickly(grid, source, options);
  CompactResult result = compactOnce(grid, source, options);
  if (!options.psnr || hasOneThreshold(result.grid)) return result;
  return corrected(std::move(result), grid, source, options);
}

}  // namespace esvr
