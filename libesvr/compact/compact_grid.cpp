#include "esvr/compact.h"

#include <cmath>
#include <utility>

#include "compact/choose_steps.h"
#include "esvr/error.h"
#include "esvr/metrics.h"

namespace esvr {
namespace {

/// Where the fit is exact, or nearly, there is nothing to compare a loss with: an error that no
/// one sees.
constexpr double kInvisiblePsnr = 110.0;

double squares(double psnr, double peak, double voxels) {
  return peak * peak * voxels * std::pow(10.0, -psnr / 10.0);
}

double allowedError(double fitted, const SparseVolume& source, const Box& box,
                    const CompactOptions& options) {
  const double peak = peakOf(source), voxels = box.volume();
  if (options.psnr) return squares(*options.psnr, peak, voxels);
  return fitted * std::pow(10.0, options.loss / 10.0) + squares(kInvisiblePsnr, peak, voxels);
}

void requireOneKappa(const EncodedGrid& grid) {
  for (const auto& chunk : grid.field.chunks)
    if (!chunk.ellipsoids.kappa.empty())
      throw RuntimeFailure("cannot quantise grid '" + grid.descriptor.name +
                           "': its ellipsoids have kappas of their own");
}

}  // namespace

CompactResult compactGrid(const EncodedGrid& grid, const SparseVolume& source,
                          const CompactOptions& options) {
  requireOneKappa(grid);
  CompactResult result{grid, {}, 0.0};
  if (grid.field.primitiveCount() == 0) return result;
  const Box box = options.box.value_or(activeBox(source));
  const TrialMaker maker(grid, source, box);
  Trial chosen = chooseSteps(maker, allowedError(maker.error(), source, box, options));
  result.grid.field = std::move(chosen.field);
  result.grid.quantised = std::move(chosen.quantised);
  result.steps = chosen.steps;
  result.loss = maker.error() > 0.0 ? 10.0 * std::log10(chosen.error / maker.error()) : 0.0;
  return result;
}

}  // namespace esvr
