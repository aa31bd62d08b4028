#include "convert/bounded.h"

#include <string>
#include <utility>

#include "compact/measure_layers.h"
#include "convert/size_search.h"
#include "core/add_seconds.h"
#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"
#include "esvr/residual.h"

namespace esvr::convert {
namespace {

// docs/benchmarks.md, "Voxels or a residual within an error bound", has the sizes that follow.
/// The ellipsoids of a grid with a residual get this fraction (1/4) of the voxels' bytes.
constexpr std::uint64_t kEllipsoidBytesDivisor = 4;
/// Largest size of a short fit's grid, relative to the voxels', at which a full fit is tried.
constexpr double kMaxPromisingRatio = 1.15;

double absoluteBound(const BoundGoal& goal, const SparseVolume& source) {
  if (!goal.relative) return goal.bound;
  const ValueRange range = activeRange(source);
  return goal.bound * (double(range.max) - double(range.min));
}

Conversion asVoxels(const Job& job, VoxelLayer layer) {
  Conversion conversion;
  conversion.grid = makeStoredVoxels(job.input.descriptor, job.input.source, std::move(layer));
  return conversion;
}

/// A grid of ellipsoids with a residual; nothing if no grid is small enough or there is no residual
/// that keeps the bound.
std::optional<Conversion> withEllipsoids(const Job& job, double bound, std::uint64_t bytes) {
  auto conversion = searchSize(job, bytes).conversion;
  if (!conversion) return std::nullopt;
  auto grid = withResidual(std::move(conversion->grid), job.input.source, bound);
  if (!grid) return std::nullopt;
  conversion->grid = std::move(*grid);
  const Box box = job.options.fit.box.value_or(activeBox(job.input.source));
  conversion->grid.layerErrors = measureLayers(conversion->grid, job.input.source, box);
  return conversion;
}

/// The smallest conversion so far, and the sizes that were compared.
struct Smallest {
  Conversion conversion;
  ChoiceRecord choice;
  bool insists = false;  ///< ellipsoids are taken even if voxels are smaller
  Decision residual{};

  void take(Conversion now) {
    const std::uint64_t bytes = bytesAdded(now.grid);
    if (choice.ellipsoids && bytes >= choice.ellipsoids->bytes) return;
    choice.ellipsoids = Candidate{bytes};
    if (insists || bytes < choice.voxels->bytes) conversion = std::move(now);
  }

  /// Writes the figures into the conversion.
  void record() {
    residual.used = conversion.grid.residual.has_value();
    residual.bytesWithout = choice.voxels->bytes;
    if (choice.ellipsoids) {
      residual.bytesWith = choice.ellipsoids->bytes;
      choice.ellipsoids->seconds = residual.seconds;
    }
    conversion.choice = choice;
    conversion.decisions.residual = residual;
  }
};

/// Tries a short fit, and a full one if the size of the short fit's grid is near the voxels'.
void tryEllipsoids(const Job& job, double bound, Smallest& best) {
  ConvertOptions shortFit = job.options;
  shortFit.fit = shortened(shortFit.fit);
  for (const ConvertOptions* options : {&std::as_const(shortFit), &job.options}) {
    auto now = withEllipsoids({job.input, *options}, bound,
                              best.choice.voxels->bytes / kEllipsoidBytesDivisor);
    if (!now) return;
    const bool promising =
        double(bytesAdded(now->grid)) <= kMaxPromisingRatio * double(best.choice.voxels->bytes);
    best.take(std::move(*now));
    if (!promising) return;
  }
}

void tryTimed(const Job& job, double bound, Smallest& best) {
  best.residual.tried = true;
  best.residual.seconds = secondsOf([&] { tryEllipsoids(job, bound, best); });
}

}  // namespace

std::optional<double> boundOf(const Goal& goal, const SparseVolume& source) {
  if (std::holds_alternative<LosslessGoal>(goal)) return 0.0;
  if (const auto* within = std::get_if<BoundGoal>(&goal)) return absoluteBound(*within, source);
  return std::nullopt;
}

Conversion convertLossless(const Job& job) {
  if (job.input.descriptor.valueType == ValueType::kDouble)
    throw UsageError(
        "grid '" + job.input.descriptor.name +
        "' has values of type double, which are read as float32; a lossless file cannot hold them");
  return asVoxels(job, exactLayer(job.input.source));
}

Conversion convertWithin(const Job& job, const BoundGoal& goal) {
  const SparseVolume& source = job.input.source;
  const double bound = absoluteBound(goal, source);
  if (bound == 0.0) return asVoxels(job, exactLayer(source));
  Conversion voxels = asVoxels(job, boundedLayer(source, bound, voxelActivity(job)));
  const bool insists = job.options.representation == Representation::kEllipsoids;
  if (isNarrowBand(job.input.descriptor, source) && !insists) return voxels;
  Smallest best{std::move(voxels), {}, insists};
  best.choice.voxels = Candidate{bytesAdded(best.conversion.grid)};
  if (job.options.representation != Representation::kVoxels) tryTimed(job, bound, best);
  if (insists && !best.choice.ellipsoids)
    throw UsageError("grid '" + job.input.descriptor.name +
                     "' has no ellipsoids with a residual that keep the bound");
  best.record();
  return std::move(best.conversion);
}

}  // namespace esvr::convert
