#include "esvr/convert.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "convert/attempt.h"
#include "convert/choice.h"
#include "convert/exact_voxels.h"
#include "convert/narrow_band.h"
#include "convert/preset.h"
#include "convert/summable.h"
#include "convert/unless_cancelled.h"
#include "esvr/error.h"
#include "esvr/grid.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"
#include "format/activity_sections.h"

namespace esvr {
namespace {

using convert::Job;

double absoluteBound(const BoundGoal& goal, const SparseVolume& source) {
  return goal.relative ? goal.bound * valueRangeOf(source) : goal.bound;
}

/// The largest absolute error that a goal allows; nothing for a goal without a bound.
std::optional<double> boundOf(const Goal& goal, const SparseVolume& source) {
  if (std::holds_alternative<LosslessGoal>(goal)) return 0.0;
  if (const auto* within = std::get_if<BoundGoal>(&goal)) return absoluteBound(*within, source);
  return std::nullopt;
}

/// Stores a fit in the form that the options determine.
Conversion stored(const Job& job, FitResult fit, const CommonFitOptions& options) {
  const StorageOptions& storage = job.options.storage;
  StoredGrid grid = convert::storedGridOf(job, fit);
  grid.curve = withoutTimes(fit.curve);
  if (storage.form == Storage::kFloat32) {
    Conversion conversion;
    conversion.fit = std::move(fit);
    conversion.grid = std::move(grid);
    return conversion;
  }
  CompactResult compact =
      convert::compacted(job, grid, fit, {.loss = CompactOptions{}.loss, .psnr = options.psnr});
  return convert::conversionOf(std::move(fit), std::move(compact));
}

/// Calls the conversion that belongs to a goal.
class Converter {
 public:
  explicit Converter(Job job) : job_(job) {}

  Conversion operator()(const FitGoal&) const {
    const FitOptions& options = job_.options.fit;
    return convert::unlessExactIsSmaller(
        job_, [&] { return stored(job_, fit(job_.input.source, options), options); });
  }
  Conversion operator()(const PresetGoal& goal) const {
    return convert::convertToPreset(job_, goal, [&] { return (*this)(FitGoal{}); });
  }
  Conversion operator()(const SizeGoal& goal) const {
    if (job_.options.storage.form != Storage::kCompact)
      throw UsageError("a size needs compact storage; the size of float32 storage is fixed");
    ConvertOptions options = job_.options;
    options.storage.activity = convert::activityForSize(job_, goal.bytes);
    return convert::convertToSize({job_.input, options, job_.limits}, goal.bytes);
  }
  Conversion operator()(const PsnrGoal& goal) const {
    return convert::convertToPsnr(job_, {goal.psnr});
  }
  Conversion operator()(const BoundGoal& goal) const {
    const SparseVolume& source = job_.input.source;
    const double bound = absoluteBound(goal, source);
    return asVoxels(bound == 0.0 ? exactLayer(source)
                                 : boundedLayer(source, bound, convert::voxelActivity(job_),
                                                convert::voxelSigns(job_), job_.input.simplified,
                                                convert::decodedValues(job_)));
  }
  Conversion operator()(const LosslessGoal&) const {
    if (job_.input.descriptor.valueType == ValueType::kDouble)
      throw UsageError(
          "grid '" + shownName(job_.input.descriptor.name) +
          "' has values of type double, which are read as float32; a lossless grid cannot hold "
          "them; choose a bound or a PSNR instead");
    return asVoxels(exactLayer(job_.input.source));
  }

 private:
  [[nodiscard]] Conversion asVoxels(VoxelLayer layer) const {
    Conversion conversion;
    conversion.grid = makeStoredVoxels(job_.input.descriptor, job_.input.source, std::move(layer));
    return conversion;
  }

  Job job_;
};

/// Encodes and decodes a grid, so that the caller gets the same grid as a reader of the file. A
/// cancelled conversion keeps the grid that is there.
/// \param previous  the grid of the previous frame; null: the grid stands alone
StoredGrid throughTheFormat(StoredGrid grid, const StoredGrid* previous,
                            const VoxelMemory& memory) {
  EsvrFile file, before;
  file.grids.push_back(std::move(grid));
  if (previous) before.grids.push_back(*previous);
  const EsvrFile* const frame = previous ? &before : nullptr;
  auto read = convert::unlessCancelled([&] {
    const auto bytes = encodeFrame(file, frame);
    return std::optional(
        std::move(decodeFrame(bytes, "the stored grid", {.memory = memory}, frame).grids.front()));
  });
  return read ? std::move(*read) : std::move(file.grids.front());
}

/// Checks the decoded grid against the bound.
void requireBound(const ConvertInput& input, const SparseVolume& decoded, double bound) {
  const double error = largestDifference(input.source, decoded);
  if (error > bound)
    throw RuntimeFailure("grid '" + shownName(input.descriptor.name) + "': an error of " +
                         std::to_string(error) + " exceeds the bound of " + std::to_string(bound));
}

/// Checks the decoded grid against all that it promises.
void requirePromises(const Job& job, const StoredGrid& grid) {
  const SparseVolume& source = job.input.source;
  const auto bound = boundOf(job.options.goal, source);
  if (!bound && !job.options.fit.narrowBand) return;
  const BestSoFar completion;  // no grid is returned that was not checked
  const SparseVolume decoded = decodeGrid(grid, {.memory = memoryOf(source)});
  if (bound) requireBound(job.input, decoded, *bound);
  if (job.options.fit.narrowBand) convert::requireSigns(job.input, decoded);
}

void requirePossible(const ConvertOptions& options) {
  const Representation wanted = options.representation;
  if (wanted == Representation::kVoxels && std::holds_alternative<FitGoal>(options.goal))
    throw UsageError("voxels need a goal: a PSNR, a size, a bound or lossless storage");
  if (wanted == Representation::kVoxels && options.storage.form == Storage::kFloat32)
    throw UsageError("float32 storage is a form of ellipsoids; it excludes voxels");
  const bool wantsEllipsoids =
      wanted == Representation::kEllipsoids || options.storage.form == Storage::kFloat32;
  if (wantsEllipsoids && std::holds_alternative<BoundGoal>(options.goal))
    throw UsageError(
        "ellipsoids do not bound the error of every voxel; store voxels, or choose a PSNR or a "
        "size");
  if (wanted == Representation::kEllipsoids && std::holds_alternative<LosslessGoal>(options.goal))
    throw UsageError("ellipsoids are not lossless");
}

[[noreturn]] void refuseSums(const ConvertInput& input, Coord tooLarge) {
  throw BadInput("grid '" + shownName(input.descriptor.name) + "': the value at " +
                 toString(tooLarge) +
                 " is too large for a sum of ellipsoids in float32; store voxels, with a PSNR, a "
                 "size, a bound or lossless");
}

/// The representation of a grid: voxels, if its values are too large for sums.
Representation possibleRepresentation(const ConvertInput& input, const ConvertOptions& options) {
  const auto tooLarge = convert::tooLargeForSums(input.source);
  if (!tooLarge || std::holds_alternative<LosslessGoal>(options.goal))
    return options.representation;
  if (options.representation == Representation::kEllipsoids ||
      options.storage.form == Storage::kFloat32 || std::holds_alternative<FitGoal>(options.goal))
    refuseSums(input, *tooLarge);
  return Representation::kVoxels;
}

/// The sample for a remark on exact voxels. Coding it takes at most 0.2 s.
constexpr convert::SampleSize kRemarkSample{.bricks = 512, .runs = 32};

/// The estimated bytes of exact voxels, if an option insisted on ellipsoids and these take more.
std::optional<std::uint64_t> smallerExactBytes(const Job& job, const StoredGrid& grid) {
  const bool insists = job.options.representation == Representation::kEllipsoids ||
                       job.options.storage.form == Storage::kFloat32;
  if (!insists || grid.voxels) return std::nullopt;
  const auto exact = convert::estimateExactVoxels(job.input, kRemarkSample).bytes;
  return exact < bytesAdded(grid) ? std::optional(exact) : std::nullopt;
}

/// True if a grid should hold voxels because its predecessor does. The difference from it takes few
/// bytes, so that no fit is made for comparison.
bool keepsVoxels(const ConvertOptions& options) {
  const bool hasQuality = std::holds_alternative<PresetGoal>(options.goal) ||
                          std::holds_alternative<PsnrGoal>(options.goal);
  return options.previous && options.previous->voxels && hasQuality &&
         options.representation == Representation::kAuto &&
         options.storage.form == Storage::kCompact;
}

/// The mask of the previous frame, moved to where the voxels of the source are.
std::vector<BrickMask> expectedMasks(const SparseVolume& source, const StoredGrid& previous) {
  const SparseVolume before = decodeGrid(previous, {.memory = memoryOf(source)});
  const auto maskOf = [](const SparseVolume& volume) {
    format::Mask mask{{}, volume.active};
    for (std::size_t b = 0; b < volume.brickCount(); ++b)
      mask.bricks.push_back(volume.brickCorner(b));
    return mask;
  };
  return format::movedMask(maskOf(source), maskOf(before));
}

/// The root mean square of the errors at active voxels with which a grid has a PSNR; nothing for goals
/// without one. All errors are taken to be at active voxels.
std::optional<double> errorOf(const ConvertOptions& options, const SparseVolume& source) {
  const double peak = options.fit.peak.value_or(peakOf(source));
  if (std::holds_alternative<PresetGoal>(options.goal))
    return peak * std::pow(10.0, -presetPsnr(options.fit.preset) / 20.0);
  const auto* goal = std::get_if<PsnrGoal>(&options.goal);
  if (!goal) return std::nullopt;
  const Box box = options.fit.box.value_or(activeBox(source));
  const double share = box.volume() / double(std::max<std::uint64_t>(activeVoxelCount(source), 1));
  return peak * std::pow(10.0, -goal->psnr / 20.0) * std::sqrt(std::max(share, 1.0));
}

/// The mean of the active values, within their range.
float meanOf(const SparseVolume& volume, const ValueRange& range) {
  double sum = 0.0, count = 0.0;
  for (std::size_t b = 0; b < volume.brickCount(); ++b) {
    const auto values = volume.brickValues(b);
    double ofBrick = 0.0;
    for (int v = 0; v < kBrickVoxels; ++v)
      if (volume.active[b].test(v)) ofBrick += values[std::size_t(v)];
    sum += ofBrick, count += volume.active[b].count();
  }
  return std::clamp(float(sum / count), range.min, range.max);
}

/// True if all inactive voxels have the background.
bool isUniformOutside(const SparseVolume& volume) {
  for (std::size_t b = 0; b < volume.brickCount(); ++b)
    for (int v = 0; v < kBrickVoxels; ++v)
      if (!volume.active[b].test(v) && volume.brickValues(b)[std::size_t(v)] != volume.background)
        return false;
  return true;
}

/// The background to which the values of a volume are stored if its own is far from them: that of
/// the previous frame if it is among them, or else their mean. Nothing if its own will do.
std::optional<float> nearBackground(const ConvertInput& input, const ConvertOptions& options) {
  const SparseVolume& source = input.source;
  if (std::holds_alternative<LosslessGoal>(options.goal)) return std::nullopt;
  const ValueRange range = activeRange(source);
  if (!spanOf(range, source.background).farBackground || !isUniformOutside(source) ||
      isNarrowBand(input.descriptor, source))
    return std::nullopt;
  if (const StoredGrid* previous = options.previous; previous && previous->farBackground) {
    const float before = previous->field.background;
    if (range.min <= before && before <= range.max) return before;
  }
  return meanOf(source, range);
}

/// Converts a volume whose background is far from its values relative to a background among them.
/// The step from one to the other at the border of the active voxels would otherwise take all
/// ellipsoids, and sums in float32 would lose the differences of the values. The exact mask is stored,
/// since a voxel with the wrong state would have a wrong value altogether.
Conversion convertNear(const ConvertInput& given, const ConvertOptions& options, float background) {
  GridDescriptor descriptor = given.descriptor;
  descriptor.background = background;
  SparseVolume source = given.source;
  setBackground(background, source);
  ConvertOptions own = options;
  own.storage.activity = Activity::kExact;
  StoredGrid before;  // the previous frame, as it is without its far background
  if (own.previous && own.previous->farBackground && own.previous->field.background == background) {
    before = *own.previous;
    before.descriptor.background = background;
    before.farBackground = false;
    own.previous = &before;
  } else {
    own.previous = nullptr;
  }
  Conversion conversion = convertVolume({descriptor, source}, own);
  conversion.grid.descriptor = given.descriptor;
  conversion.grid.farBackground = true;
  return conversion;
}

}  // namespace

double presetPsnr(Preset preset) {
  switch (preset) {
    case Preset::kDraft:
      return 32.0;
    case Preset::kHigh:
      return 50.0;
    case Preset::kStandard:
      break;
  }
  return 40.0;
}

Conversion convertVolume(const ConvertInput& given, const ConvertOptions& options) {
  requirePossible(options);
  const CancelScope scope(CancelScope::orToken(options.fit.cancel));
  CancelScope::check();
  if (const auto background = nearBackground(given, options))
    return convertNear(given, options, *background);
  ConvertOptions own = options;
  if (own.previous && own.previous->farBackground) own.previous = nullptr;
  SimplifiedMasks::MakeExpected expected;
  if (own.previous) expected = [&] { return expectedMasks(given.source, *own.previous); };
  const SimplifiedMasks masks(given.source, std::move(expected),
                              errorOf(own, given.source));  // all attempts share them
  const ConvertInput input{given.descriptor, given.source,
                           given.simplified ? given.simplified : &masks};
  own.fit.cancel = CancelScope::token();
  own.fit.narrowBand = isNarrowBand(input.descriptor, input.source);
  if (keepsVoxels(own)) own.representation = Representation::kVoxels;
  own.representation = possibleRepresentation(input, own);
  const auto convertTo = [](const Job& job) {
    return std::visit(Converter(job), job.options.goal);
  };
  Conversion conversion = own.fit.narrowBand ? convert::convertNarrowBand({input, own}, convertTo)
                                             : convertTo({input, own});
  conversion.smallerExactBytes = convert::unlessCancelled([&] {
    return smallerExactBytes({input, own}, conversion.grid);
  });
  conversion.grid =
      throughTheFormat(std::move(conversion.grid), own.previous, memoryOf(input.source));
  requirePromises({input, own}, conversion.grid);
  return conversion;
}

PaperConversion convertByPaper(const ConvertInput& input, const PaperFitOptions& options,
                               const StorageOptions& storage) {
  if (options.method.learnK && storage.form == Storage::kCompact)
    throw UsageError(
        "a k for each ellipsoid needs float32 storage; compact storage has one edge for all");
  if (isNarrowBand(input.descriptor, input.source))
    throw UsageError(
        "grid '" + shownName(input.descriptor.name) +
        "' is a level set; the paper's method cannot fit it, because its loss compares windows "
        "that a narrow band does not fill");
  if (const auto tooLarge = convert::tooLargeForSums(input.source)) refuseSums(input, *tooLarge);
  const CancelScope scope(CancelScope::orToken(options.cancel));
  PaperFitResult made = fitByPaper(input.source, options);
  ConvertOptions own;
  static_cast<CommonFitOptions&>(own.fit) = options;
  own.storage = storage;
  Conversion conversion = stored({input, own}, std::move(made.fit), options);
  conversion.grid = throughTheFormat(std::move(conversion.grid), nullptr, memoryOf(input.source));
  return {std::move(conversion), std::move(made.record)};
}

}  // namespace esvr
