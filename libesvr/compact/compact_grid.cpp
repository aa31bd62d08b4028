#include "esvr/compact.h"

#include <cmath>
#include <utility>

#include "compact/choose_steps.h"
#include "compact/measure_layers.h"
#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"

namespace esvr {
namespace {

constexpr double kMargin = 5e-4;  // dB: sums in another order, or by a GPU, must not fall short
constexpr double kAlike = 80.0;   // dB: up to it they differ by less than that

double allowedError(const TrialMaker& maker, const CompactOptions& options) {
  if (options.psnr) return maker.squaresOf(*options.psnr + kMargin);
  return maker.error() * std::pow(10.0, options.loss / 10.0) + maker.invisibleError();
}

Trial choose(TrialMaker& maker, const CompactOptions& options) {
  if (options.bytes) return chooseStepsFor(maker, *options.bytes);
  return chooseStepsWithin(maker, allowedError(maker, options));
}

/// Near float32's own precision a GPU's sums and a reader's differ by more than the margin.
bool missedByReader(const StoredGrid& grid, const SparseVolume& source,
                    const CompactOptions& options) {
  if (!options.psnr || *options.psnr < kAlike || options.device.kind == DeviceKind::kCpu)
    return false;
  const auto metrics =
      compareVolumes(source, decodeGrid(grid), {.box = options.box, .peak = {}, .ssim = false});
  return metrics.psnrBox < *options.psnr;
}

void requireOneKappa(const StoredGrid& grid) {
  for (const auto& chunk : grid.field.chunks)
    if (!chunk.ellipsoids.kappa.empty())
      throw RuntimeFailure("cannot quantise grid '" + grid.descriptor.name +
                           "': its ellipsoids have kappas of their own");
}

}  // namespace

CompactResult compactGrid(const StoredGrid& grid, const SparseVolume& source,
                          const CompactOptions& options) {
  requireOneKappa(grid);
  CompactResult result{grid, {}, 0.0, 0};
  if (grid.field.ellipsoidCount() == 0) return result;
  const Box box = options.box.value_or(activeBox(source));
  TrialMaker maker(grid, {source, box, options.device});
  Trial chosen = choose(maker, options);
  // a mask decides on voxels that the field's values do not show
  const bool byValues = grid.topology != TopologyKind::kMask;
  if (byValues) result.grid.layerErrors = maker.layerErrors(chosen);
  result.grid.field = std::move(chosen.field);
  result.grid.quantised = std::move(chosen.quantised);
  if (!byValues) result.grid.layerErrors = measureLayers(result.grid, source, box);
  if (missedByReader(result.grid, source, options)) {
    CompactOptions again = options;
    again.device = {};
    return compactGrid(grid, source, again);
  }
  result.steps = chosen.steps;
  result.bytes = chosen.bytes;
  result.loss = maker.error() > 0.0 ? 10.0 * std::log10(chosen.error / maker.error()) : 0.0;
  return result;
}

}  // namespace esvr
