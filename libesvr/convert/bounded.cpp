#include "convert/bounded.h"

#include <span>
#include <string>
#include <utility>

#include "compact/measure_layers.h"
#include "convert/exact_voxels.h"
#include "convert/residual_trial.h"
#include "convert/size_search.h"
#include "convert/unless_cancelled.h"
#include "core/add_seconds.h"
#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "esvr/grid_names.h"
#include "esvr/metrics.h"
#include "esvr/residual.h"

namespace esvr::convert {
namespace {

// docs/figures/benchmarks.md, "Voxels or a residual within an error bound", has the sizes that follow.
/// The ellipsoids of a grid with a residual get this fraction (1/4) of the bytes of its voxels.
constexpr std::uint64_t kEllipsoidBytesDivisor = 4;
/// Largest residualRatio() at which ellipsoids are fitted. The ratio of a whole volume without
/// symmetry is larger by up to 0.09 (docs/lab-notes.md, "Deciding on a residual").
constexpr double kPromisingRatio = 0.9;

double absoluteBound(const BoundGoal& goal, const SparseVolume& source) {
  return goal.relative ? goal.bound * valueRangeOf(source) : goal.bound;
}

Conversion asVoxels(const Job& job, VoxelLayer layer) {
  Conversion conversion;
  conversion.grid = makeStoredVoxels(job.input.descriptor, job.input.source, std::move(layer));
  return conversion;
}

/// True if the active voxels of a decoded grid are nearly those of the source.
bool overlaps(const Job& job, const StoredGrid& grid) {
  const SparseVolume& source = job.input.source;
  return compareVolumes(source, decodeGrid(grid, {.memory = memoryOf(source)})).iou > kMinOverlap;
}

/// The simplified mask that leaves out no voxel which differs from the background by more than the
/// bound.
std::span<const BrickMask> maskWithin(double bound, const SimplifiedMasks& masks) {
  constexpr double kErrorsInBound = 8.0;  // twice what may differ, since the error is rounded
  return masks.forError(bound / kErrorsInBound);
}

/// A residual that keeps the bound. With kAuto, active voxels are found by value, unless the overlap
/// does not suffice.
std::optional<StoredGrid> withActiveResidual(const Job& job, const StoredGrid& grid, double bound) {
  const SparseVolume& source = job.input.source;
  auto found = withResidual(grid, source, bound);
  if (job.options.storage.activity != Activity::kAuto || (found && overlaps(job, *found)))
    return found;
  const SimplifiedMasks own(source);
  StoredGrid masked = grid;
  storeMask(source, maskWithin(bound, job.input.simplified ? *job.input.simplified : own), masked);
  return withResidual(std::move(masked), source, bound);
}

/// The job with active voxels by value where it leaves the choice to the conversion.
ConvertOptions byValue(const Job& job) {
  ConvertOptions options = job.options;
  if (options.storage.activity == Activity::kAuto) options.storage.activity = Activity::kByValue;
  return options;
}

/// A grid of ellipsoids with a residual; nothing if no grid is small enough or there is no residual
/// that keeps the bound.
std::optional<Conversion> withEllipsoids(const Job& job, double bound, std::uint64_t bytes) {
  const ConvertOptions options = byValue(job);
  auto conversion = searchSize({job.input, options, job.limits}, bytes).conversion;
  if (!conversion) return std::nullopt;
  auto grid = withActiveResidual(job, conversion->grid, bound);
  if (!grid) return std::nullopt;
  conversion->grid = std::move(*grid);
  const Box box = job.options.fit.box.value_or(activeBox(job.input.source));
  conversion->grid.layerErrors =
      measureLayers(conversion->grid, job.input.source, {.box = box, .peak = job.options.fit.peak});
  return conversion;
}

/// The smaller conversion so far, and the sizes that were compared.
struct Smaller {
  Conversion conversion;
  ChoiceRecord choice;
  bool insists = false;  ///< ellipsoids are taken even if voxels are smaller
  Decision residual{};

  [[nodiscard]] bool hasEllipsoids() const {
    return choice.ellipsoids && !choice.ellipsoids->estimated;
  }

  void take(Conversion now) {
    const std::uint64_t bytes = bytesAdded(now.grid);
    choice.ellipsoids = Candidate{bytes};
    if (insists || bytes < choice.voxels->bytes) conversion = std::move(now);
  }

  /// Writes the figures into the conversion.
  void record() {
    residual.used = conversion.grid.residual.has_value();
    residual.bytesWithout = choice.voxels->bytes;
    if (hasEllipsoids()) residual.bytesWith = choice.ellipsoids->bytes;
    if (choice.ellipsoids) choice.ellipsoids->seconds = residual.seconds;
    conversion.choice = choice;
    conversion.decisions.residual = residual;
  }
};

/// True if a sample promises that ellipsoids of `bytes` and a residual are smaller than the voxels.
/// Otherwise the estimate of their bytes is recorded, unless `bytes` hold not even one ellipsoid.
bool isPromising(const Job& job, double bound, std::uint64_t bytes, Smaller& best) {
  const double voxels = double(best.choice.voxels->bytes);
  if (double(bytes) < kMinBytesPerEllipsoid) return false;
  const double ratio = residualRatio(job, bound, double(bytes) / voxels);
  if (ratio <= kPromisingRatio) return true;
  best.choice.ellipsoids = Candidate{std::uint64_t(ratio * voxels), {}, true};
  return false;
}

/// Takes ellipsoids if they are smaller than the voxels or an option insists on them.
void tryEllipsoids(const Job& job, double bound, Smaller& best) {
  const std::uint64_t beside = bytesBesideVoxels(job.input);
  const std::uint64_t bytes = (best.choice.voxels->bytes - beside) / kEllipsoidBytesDivisor;
  const auto fitted = [&]() -> std::optional<Conversion> {
    if (!best.insists && !isPromising(job, bound, bytes, best)) return std::nullopt;
    return withEllipsoids(job, bound, beside + bytes);
  };
  if (auto found = fitted()) best.take(std::move(*found));
}

/// A cancellation counts as finding none, unless an option leaves no voxels to take instead.
void tryTimed(const Job& job, double bound, Smaller& best) {
  best.residual.tried = true;
  best.residual.seconds = secondsOf([&] {
    const auto tried = [&] {
      tryEllipsoids(job, bound, best);
      return true;
    };
    (void)(best.insists ? tried() : unlessCancelled(tried));
  });
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
        "grid '" + shownName(job.input.descriptor.name) +
        "' has values of type double, which are read as float32; a lossless grid cannot hold them; "
        "choose a bound or a PSNR instead");
  return asVoxels(job, exactLayer(job.input.source));
}

Conversion convertWithin(const Job& job, const BoundGoal& goal) {
  const SparseVolume& source = job.input.source;
  const double bound = absoluteBound(goal, source);
  if (bound == 0.0) return asVoxels(job, exactLayer(source));
  Conversion voxels = asVoxels(job, boundedLayer(source, bound, voxelActivity(job), voxelSigns(job),
                                                 job.input.simplified, decodedValues(job)));
  const bool insists = job.options.representation == Representation::kEllipsoids;
  if (isNarrowBand(job.input.descriptor, source) && !insists) return voxels;
  Smaller best{std::move(voxels), {}, insists};
  const auto bytes =
      unlessCancelled([&] { return std::optional(bytesAdded(best.conversion.grid)); });
  if (!bytes && insists) throw Cancelled();
  if (!bytes) return std::move(best.conversion);
  best.choice.voxels = Candidate{*bytes};
  if (job.options.representation != Representation::kVoxels) tryTimed(job, bound, best);
  if (insists && !best.hasEllipsoids())
    throw UsageError("grid '" + shownName(job.input.descriptor.name) +
                     "' has no ellipsoids with a residual that keep the bound; store voxels, or "
                     "allow a larger error");
  best.record();
  return std::move(best.conversion);
}

}  // namespace esvr::convert
