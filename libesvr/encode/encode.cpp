// From a volume and a goal to a stored grid. The chapter goes from inside out: goals, what a stored grid promises, and
// convertVolume(). choice.cpp has the goals that voxels and ellipsoids can both reach.

#include "esvr/encode.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "core/add_seconds.h"
#include "core/counted.h"
#include "core/parallel.h"
#include "encode/choice.h"
#include "encode/ellipsoids.h"
#include "encode/non_finite.h"
#include "encode/signs.h"
#include "encode/tone.h"
#include "encode/voxels.h"
#include "esvr/error.h"
#include "esvr/grid.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"
#include "format/section_table.h"
#include "format/voxel_sections.h"

namespace esvr::encode {
namespace {

// ---- Goals

double absoluteBound(const BoundGoal& goal, const SparseVolume& source) {
  return goal.relative ? goal.bound * valueRangeOf(source) : goal.bound;
}

/// The largest absolute error that a goal allows; nothing for a goal without a bound.
std::optional<double> boundOf(const Goal& goal, const SparseVolume& source) {
  if (std::holds_alternative<LosslessGoal>(goal)) return 0.0;
  if (const auto* within = std::get_if<BoundGoal>(&goal)) return absoluteBound(*within, source);
  return std::nullopt;
}

/// True for the goals that are a quality: a preset, and a PSNR of values or of pictures.
bool isQuality(const Goal& goal) {
  return std::holds_alternative<PresetGoal>(goal) || std::holds_alternative<PsnrGoal>(goal) ||
         std::holds_alternative<PictureGoal>(goal);
}

/// The quality of a PresetGoal, and that of the preset for other goals.
PresetQuality presetQuality(const ConvertOptions& options) {
  PresetQuality quality = qualityOf(options.fit.preset);
  if (const auto* goal = std::get_if<PresetGoal>(&options.goal)) {
    quality.psnr += goal->abovePreset, quality.picturePsnr += goal->abovePreset;
    quality.surfaceBound *= std::pow(10.0, -goal->abovePreset / 20.0);
  }
  return quality;
}

/// The quality of a goal that is one, dB, as the job measures it.
double wantedQuality(const Job& job) {
  if (const auto* psnr = std::get_if<PsnrGoal>(&job.options.goal)) return psnr->psnr;
  if (const auto* pictures = std::get_if<PictureGoal>(&job.options.goal)) return pictures->psnr;
  const PresetQuality preset = presetQuality(job.options);
  return seesPictures(job) ? preset.picturePsnr
                           : preset.psnr + boxGain(job.input.source, job.options);
}

/// By how many dB the quality of a conversion is above that of the preset; 0 if it is not known.
double abovePreset(const Job& job, const Conversion& made) {
  if (!made.choice) return 0.0;
  const auto& stored = made.grid.voxels ? made.choice->voxels : made.choice->ellipsoids;
  const bool isKnown = stored && stored->psnr && std::isfinite(*stored->psnr);
  return isKnown ? *stored->psnr - wantedQuality(job) : 0.0;
}

/// \throws UsageError  the quality of a goal is none
void requireQuality(const Goal& goal) {
  const auto* values = std::get_if<PsnrGoal>(&goal);
  const auto* pictures = std::get_if<PictureGoal>(&goal);
  if (!values && !pictures) return;
  const double psnr = values ? values->psnr : pictures->psnr;
  if (!(psnr >= 0.0 && std::isfinite(psnr)))
    throw UsageError("a PSNR must be finite and not below 0 dB, but is " + shortText(psnr));
}

/// Active voxels per ellipsoid at the largest number of ellipsoids that a preset may take. With more of them, voxels take
/// fewer bytes.
constexpr double kLeastVoxelsEach = 8.0;
/// Share of the bytes of voxels that ellipsoids must be expected to stay below to be fitted for a preset, and bytes of voxels
/// below which no ellipsoids are tried, for a preset and for a PSNR: a fit takes longer than coding, and little could be saved.
constexpr double kWorthwhileShare = 0.85;
constexpr std::uint64_t kSmallEnough = 1024, kSmallForPsnr = 512;

/// Calls the conversion that belongs to a goal.
class Converter {
 public:
  explicit Converter(const Job& job) : job_(job) {}

  Conversion operator()(const FitGoal&) const { return fitOrExact(job_); }
  Conversion operator()(const PresetGoal&) const {
    ConvertOptions options = job_.options;
    const double most = double(activeVoxelCount(job_.input.source)) / kLeastVoxelsEach;
    options.fit.count = std::max<std::size_t>(std::size_t(most), 1);
    const Job job{job_.input, options, job_.judge, job_.scout};
    return convertToQuality(job, wantedQuality(job), {kWorthwhileShare, kSmallEnough});
  }
  Conversion operator()(const SizeGoal& goal) const {
    if (job_.options.storage.form != Storage::kCompact)
      throw UsageError("a size needs compact storage; the size of float32 storage is fixed");
    return convertToSize(job_, goal.bytes);
  }
  Conversion operator()(const PsnrGoal&) const { return forPsnr(); }
  Conversion operator()(const PictureGoal&) const { return forPsnr(); }
  Conversion operator()(const BoundGoal& goal) const {
    const SparseVolume& source = job_.input.source;
    const double bound = absoluteBound(goal, source);
    if (bound == 0.0) return asVoxels(smallestExactLayer(source));
    return orExact(asVoxels(
        boundedLayer(source, bound, voxelActivity(job_), voxelSigns(job_), decodedValues(job_))));
  }
  Conversion operator()(const RelativeBoundGoal& goal) const {
    if (!(goal.share > 0.0 && goal.share < 1.0) ||
        (goal.floor && !(*goal.floor > 0.0 && std::isfinite(float(*goal.floor)))))
      throw UsageError("a relative bound is a share between 0 and 1 of magnitudes above 0");
    RelativeLayer made = relativeLayer(job_, goal);
    Conversion conversion = asVoxels(std::move(made.layer));
    if (made.tone.isOn()) setTone(job_.input, made.tone, conversion.grid);
    return orExact(std::move(conversion));
  }
  Conversion operator()(const LosslessGoal&) const {
    if (job_.input.descriptor.valueType == ValueType::kDouble)
      throw UsageError(
          "grid '" + shownName(job_.input.descriptor.name) +
          "' has values of type double, which are read as float32; a lossless grid cannot hold "
          "them; choose a bound or a PSNR instead");
    return asVoxels(smallestExactLayer(job_.input.source));
  }

 private:
  [[nodiscard]] Conversion forPsnr() const {
    return convertToQuality(job_, wantedQuality(job_), {1.0, kSmallForPsnr});
  }

  [[nodiscard]] Conversion asVoxels(VoxelLayer layer) const {
    const BestSoFar completion;  // these voxels are the result
    Conversion conversion;
    conversion.grid = makeStoredVoxels(job_.input.descriptor, job_.input.source, std::move(layer));
    return conversion;
  }

  /// Voxels within a bound, or exact ones where these are no larger.
  [[nodiscard]] Conversion orExact(Conversion bounded) const {
    if (auto exact = smallerExactVoxels(job_, bounded.grid)) bounded.grid = std::move(exact->grid);
    return bounded;
  }

  Job job_;
};

Conversion convertToGoal(const Job& job) { return std::visit(Converter(job), job.options.goal); }

/// A frame whose ellipsoids continue those of the frame before.
/// \return nothing if it misses the quality, or takes many more bytes than the frame before
std::optional<Conversion> continueFrame(const Job& job) {
  constexpr double kMostFrameGrowth = 1.5;
  const StoredGrid& before = *job.options.previous;
  const double wanted = wantedQuality(job);
  if (isConstant(job.input.source)) return std::nullopt;
  EllipsoidSearch search(job, {.psnr = wanted}, &before);
  std::optional<Conversion> made;
  const double seconds = secondsOf([&] {
    search.draft();
    made = search.run();
  });
  if (!made) return std::nullopt;
  const double reached = search.reached() ? *search.reached() : psnrOf(job, *made);
  const Candidate figures{bytesOfEllipsoids(made->grid), reached, false, seconds};
  const double most = kMostFrameGrowth * double(bytesOfEllipsoids(before));
  const bool isGood = reached >= wanted && double(figures.bytes) <= most;
  if (!isGood && !isCancelled(job)) return std::nullopt;
  made->choice = ChoiceRecord{{}, figures};
  return made;
}

// ---- What a stored grid promises

/// Encodes and decodes a grid, so that the caller gets the same grid as a reader of the file. A
/// cancelled conversion keeps the grid that is there.
/// \param previous  the grid of the previous frame; null: the grid stands alone
StoredGrid throughTheFormat(StoredGrid grid, const StoredGrid* previous,
                            const VoxelMemory& memory) {
  const CodedVoxels coded = grid.voxels ? grid.voxels->coded : CodedVoxels{};
  EsvrFile file, before;
  file.grids.push_back(std::move(grid));
  if (previous) before.grids.push_back(*previous);
  const EsvrFile* const frame = previous ? &before : nullptr;
  auto read = unlessCancelled([&] {
    const auto bytes = encodeFrame(file, frame);
    return std::optional(
        std::move(decodeFrame(bytes, "the stored grid", {.memory = memory}, frame).grids.front()));
  });
  StoredGrid made = read ? std::move(*read) : std::move(file.grids.front());
  if (made.voxels) made.voxels->coded = coded;
  return made;
}

void requireBound(const ConvertInput& input, const SparseVolume& decoded, double bound) {
  const double error = largestDifference(input.source, decoded);
  if (!(error > bound)) return;
  const auto [found, most] = textsApart(error, bound, "%.*g", 6);
  throw RuntimeFailure("grid '" + shownName(input.descriptor.name) + "': an error of " + found +
                       " exceeds the bound of " + most);
}

/// Checks the decoded grid against all that it promises.
void requirePromises(const Job& job, const StoredGrid& grid) {
  const SparseVolume& source = job.input.source;
  const auto bound = boundOf(job.options.goal, source);
  const auto* relative = std::get_if<RelativeBoundGoal>(&job.options.goal);
  if (!bound && !relative && !job.options.fit.narrowBand) return;
  const BestSoFar completion;  // no grid is returned that was not checked
  const SparseVolume decoded = decodeGrid(grid, {.memory = memoryOf(source)});
  if (bound) requireBound(job.input, decoded, *bound);
  if (relative) requireRelativeBound(job.input, decoded, *relative);
  if (job.options.fit.narrowBand) requireSigns(job.input, decoded);
}

bool isBounded(const Goal& goal) {
  return std::holds_alternative<BoundGoal>(goal) || std::holds_alternative<RelativeBoundGoal>(goal);
}

void requirePossible(const ConvertOptions& options) {
  const Representation wanted = options.representation;
  if (wanted == Representation::kVoxels && std::holds_alternative<FitGoal>(options.goal))
    throw UsageError("voxels need a goal: a PSNR, a size, a bound or lossless storage");
  if (wanted == Representation::kVoxels && options.storage.form == Storage::kFloat32)
    throw UsageError("float32 storage is a form of ellipsoids; it excludes voxels");
  const bool wantsEllipsoids =
      wanted == Representation::kEllipsoids || options.storage.form == Storage::kFloat32;
  if (wantsEllipsoids && isBounded(options.goal))
    throw UsageError(
        "ellipsoids do not bound the error of every voxel; store voxels, or choose a PSNR or a "
        "size");
  if (wanted == Representation::kEllipsoids && std::holds_alternative<LosslessGoal>(options.goal))
    throw UsageError("ellipsoids are not lossless");
}

/// Intensities may be larger than the values, and the partial sums of many overlapping ellipsoids larger
/// still. Values up to this difference from the background leave a factor of 256 to the largest number
/// of float32.
constexpr float kLargestSummable = 0x1p120f;

template <class Is>
std::optional<std::size_t> firstBrick(const SparseVolume& volume, const Is& is) {
  using Range = tbb::blocked_range<std::size_t>;
  const std::size_t none = volume.brickCount();
  const std::size_t first = parallelReduce(
      Range(0, none), none,
      [&](const Range& bricks, std::size_t found) {
        for (std::size_t b = bricks.begin(); b < std::min(bricks.end(), found); ++b)
          if (is(b)) return b;
        return found;
      },
      [](std::size_t a, std::size_t b) { return std::min(a, b); });
  return first < none ? std::optional(first) : std::nullopt;
}

/// A voxel whose value differs too much from the background for sums in float32, or nothing.
std::optional<Coord> tooLargeForSums(const SparseVolume& volume) {
  const auto isTooLarge = [background = volume.background](float value) {
    return std::abs(double(value) - background) > kLargestSummable;
  };
  const auto brick = firstBrick(volume, [&](std::size_t b) {
    return std::ranges::any_of(volume.brickValues(b), isTooLarge);
  });
  if (!brick) return std::nullopt;
  const auto values = volume.brickValues(*brick);
  const auto place = std::ranges::find_if(values, isTooLarge) - values.begin();
  return volume.brickCorner(*brick) + voxelLocal(int(place));
}

[[noreturn]] void refuseSums(const ConvertInput& input, Coord tooLarge) {
  throw BadInput("grid '" + shownName(input.descriptor.name) + "': the value at " +
                 toString(tooLarge) +
                 " is too large for a sum of ellipsoids in float32; store voxels, with a PSNR, a "
                 "size, a bound or lossless");
}

bool mustBeEllipsoids(const ConvertOptions& options) {
  return options.representation == Representation::kEllipsoids ||
         options.storage.form == Storage::kFloat32 || std::holds_alternative<FitGoal>(options.goal);
}

/// The representation of a grid: voxels, if its values are too large for sums.
Representation possibleRepresentation(const ConvertInput& input, const ConvertOptions& options) {
  const auto tooLarge = tooLargeForSums(input.source);
  if (!tooLarge || std::holds_alternative<LosslessGoal>(options.goal))
    return options.representation;
  if (mustBeEllipsoids(options)) refuseSums(input, *tooLarge);
  return Representation::kVoxels;
}

/// The estimated bytes of exact voxels, if an option insisted on ellipsoids and these take more.
std::optional<std::uint64_t> smallerExactBytes(const Job& job, const StoredGrid& grid) {
  const bool insists = representationOf(job) == Representation::kEllipsoids;
  if (!insists || grid.voxels) return std::nullopt;
  const auto exact = estimateExactVoxels(job).bytes;
  return exact < bytesAdded(grid) ? std::optional(exact) : std::nullopt;
}

/// True if a grid should hold voxels because its predecessor does. The difference from it takes few
/// bytes, so that no fit is made for comparison.
bool keepsVoxels(const ConvertOptions& options) {
  return options.previous && options.previous->voxels && isQuality(options.goal) &&
         options.representation == Representation::kAuto &&
         options.storage.form == Storage::kCompact;
}

/// The ellipsoids of the frame before, if a frame is to continue them; null otherwise.
const StoredGrid* ellipsoidsBefore(const ConvertInput& input, const ConvertOptions& options) {
  const StoredGrid* before = options.previous;
  if (!before || !options.keepsPastErrors || before->voxels || !isQuality(options.goal))
    return nullptr;
  const bool isAlike = before->field.ellipsoidCount() > 0 &&
                       before->field.background == input.source.background &&
                       options.tone.value_or(before->tone) == before->tone;
  const bool mayContinue = options.representation != Representation::kVoxels &&
                           options.storage.form == Storage::kCompact && !options.fit.narrowBand;
  return isAlike && mayContinue ? before : nullptr;
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
  return !firstBrick(volume, [&](std::size_t b) {
    for (int v = 0; v < kBrickVoxels; ++v)
      if (!volume.active[b].test(v) && volume.brickValues(b)[std::size_t(v)] != volume.background)
        return true;
    return false;
  });
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

/// The input of ellipsoids whose inactive voxels have other values than the background, which is how the inside of a level
/// set with holes is told from its outside. No sum has these values where there is no band around them.
/// \throws BadInput  a PSNR is wanted that even the exact active voxels do not have without them
SparseVolume withoutInactive(const ConvertInput& input, const ConvertOptions& options) {
  SparseVolume flat = input.source;
  setBackground(flat.background, flat);
  const auto* wanted = std::get_if<PsnrGoal>(&options.goal);
  if (!wanted || options.storage.form != Storage::kCompact) return flat;
  const double most =
      psnrOverBox(input.source, flat, {.box = options.fit.box, .peak = options.fit.peak});
  if (most < wanted->psnr)
    throw BadInput("grid '" + shownName(input.descriptor.name) + "': ellipsoids reach at most " +
                   shortText(most) +
                   " dB, because they have no signs of inactive voxels; voxels reach any PSNR");
  return flat;
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

/// Whether a level set may be judged by its surface. The presets of wide bands are, too (isUsualBand).
bool mayBeJudgedBySurface(const ConvertInput& input, const ConvertOptions& options) {
  const bool isOpen = options.measure == Measure::kAuto &&
                      options.representation != Representation::kEllipsoids &&
                      options.storage.form == Storage::kCompact;
  return isOpen && input.descriptor.gridClass == GridClass::kLevelSet &&
         (std::holds_alternative<PresetGoal>(options.goal) ||
          (std::holds_alternative<SizeGoal>(options.goal) && !options.fit.narrowBand));
}

/// True for a narrow band of a few voxels, whose values are distances to the surface, so that their PSNR says how far
/// it moves. The peak of a wider band, such as one with markers of 10,000 in empty space, says nothing of it.
bool isUsualBand(const ConvertInput& input, const ConvertOptions& options, double change) {
  constexpr double kWidest = 16.0;  // half width, voxels: 40 dB are errors of 0.16 voxels
  return options.fit.narrowBand && input.source.background <= kWidest * change;
}

/// Converts a level set that is judged by its surface to voxels.
/// \return nothing if it has no surface or is a narrow band of the usual width, or if no voxels fit into the size
std::optional<Conversion> convertSurface(const ConvertInput& input, ConvertOptions options) try {
  const auto change = changeAcrossSurface(input.source);
  if (!change || isUsualBand(input, options, *change)) return std::nullopt;
  std::optional<double> bound;
  if (std::holds_alternative<PresetGoal>(options.goal)) {
    bound = presetQuality(options).surfaceBound * *change;
    options.goal = BoundGoal{*bound};
  }
  options.representation = Representation::kVoxels;
  options.measure = Measure::kValues;
  Conversion conversion = convertVolume(input, options);
  conversion.surfaceBound = bound;
  return conversion;
} catch (const UsageError&) {
  return std::nullopt;
}

/// Converts a volume, or its tones if there is a curve.
/// \param convert  makes a grid for a job: convertToGoal() or continueFrame()
template <class Convert>
std::optional<Conversion> convertBy(const ToneChoice& choice, const ConvertInput& given,
                                    ConvertOptions options, const Convert& convert) {
  const ToneCurve tone = choice.tone;
  const StoredGrid* const previous = options.previous;
  std::optional<Judge> judge;
  if (tone.isOn() || Judge::seesPictures(given, options)) judge.emplace(given, options, tone);
  if (judge && previous && !(previous->tone == tone)) options.previous = nullptr;
  GridDescriptor descriptor = given.descriptor;
  SparseVolume tones;
  StoredGrid before;  // the previous frame, as a grid of tones
  if (tone.isOn()) {
    tones = tonesOf(given.source, tone);
    descriptor.valueType = ValueType::kFloat;
    options.fit.peak.reset();
    if (options.previous) {
      before = *previous;
      before.tone = {};
      options.previous = &before;
    }
    if (auto* size = std::get_if<SizeGoal>(&options.goal))
      size->bytes -= std::min<std::uint64_t>(size->bytes, format::kAlignment);  // the scale, padded
  }
  const ConvertInput input{descriptor, tone.isOn() ? tones : given.source};
  const Job job{input, options, judge ? &*judge : nullptr, choice.scout};
  std::optional<Conversion> made =
      options.fit.narrowBand ? convertNarrowBand(job, convertToGoal) : convert(job);
  if (!made) return std::nullopt;
  made->smallerExactBytes = unlessCancelled([&] { return smallerExactBytes(job, made->grid); });
  {
    const BestSoFar completion;  // a grid that is there is not given up
    if (tone.isOn()) setTone(given, tone, made->grid);
    if (judge)
      made->grid.layerErrors = made->fit.end == FitEnd::kCancelled
                                   ? std::vector<LayerError>{}
                                   : layerErrorsOf(made->grid, given.source, judge->comparison());
  }
  made->byPictures = seesPictures(job);
  if (std::holds_alternative<SizeGoal>(options.goal)) made->abovePreset = abovePreset(job, *made);
  made->grid = throughTheFormat(std::move(made->grid), previous, memoryOf(given.source));
  requirePromises(job, made->grid);
  return made;
}

// ---- Conversions

/// Every conversion considers voxels, and a section of voxels has no codes for places that are farther apart.
void requireNear(const ConvertInput& input) {
  constexpr std::int32_t kTooFar = std::int32_t{1} << format::kMaxBrickBits;
  for (const Coord brick : input.source.bricks)
    if (std::max({brick.x, brick.y, brick.z}) >= kTooFar) {
      const Box box = activeBox(input.source);
      throw CannotConvert("grid '" + shownName(input.descriptor.name) +
                          "': its active voxels reach from " + toString(box.min) + " to " +
                          toString(box.max) + ": 2^24 voxels or more");
    }
}

/// The options for values that are equal but for roundings: a quality allows errors of much more than these, and one of the
/// values takes as few bytes as any other one.
ConvertOptions forConstant(const ConvertInput& input, ConvertOptions options) {
  constexpr double kReached = 120.0;  // dB; an error of two bits of 24 has 132 or more
  const auto within = [&](double psnr) { return psnr <= kReached; };
  const auto* values = std::get_if<PsnrGoal>(&options.goal);
  const auto* pictures = std::get_if<PictureGoal>(&options.goal);
  const bool isQuality = std::holds_alternative<PresetGoal>(options.goal) ||
                         (values && within(values->psnr)) || (pictures && within(pictures->psnr));
  if (!isQuality || mustBeEllipsoids(options)) return options;
  const ValueRange range = activeRange(input.source);
  if (range.min == range.max || !isConstant(range)) return options;
  options.goal = BoundGoal{double(range.max) - double(range.min)};
  options.representation = Representation::kVoxels;
  options.measure = Measure::kValues;
  options.tone.reset();
  return options;
}

Conversion converted(const ConvertInput& input, const ConvertOptions& given) {
  requirePossible(given);
  requireNear(input);
  const ConvertOptions options = forConstant(input, given);
  const CancelScope scope(CancelScope::orToken(options.fit.cancel));
  CancelScope::check();
  if (const auto background = nearBackground(input, options))
    return convertNear(input, options, *background);
  ConvertOptions own = options;
  if (own.previous && own.previous->farBackground) own.previous = nullptr;
  own.fit.cancel = CancelScope::token();
  own.fit.narrowBand = isNarrowBand(input.descriptor, input.source);
  if (mayBeJudgedBySurface(input, own))
    if (auto made = convertSurface(input, own)) return std::move(*made);
  if (keepsVoxels(own)) own.representation = Representation::kVoxels;
  own.representation = possibleRepresentation(input, own);
  if (!own.fit.narrowBand && !isUniformOutside(input.source)) {
    if (mustBeEllipsoids(own))
      return converted({input.descriptor, withoutInactive(input, own)}, options);
    if (own.representation == Representation::kAuto) own.representation = Representation::kVoxels;
  }
  if (std::holds_alternative<PictureGoal>(own.goal) && !Judge::seesPictures(input, own))
    own.goal = PresetGoal{};
  if (const StoredGrid* before = ellipsoidsBefore(input, own)) {
    if (auto made = convertBy({before->tone}, input, own, continueFrame)) return std::move(*made);
    own.previous = nullptr;  // it is another scene
  }
  return *convertBy(chooseTone(input, own), input, own, convertToGoal);
}

PaperConversion convertedByPaper(const ConvertInput& input, const PaperFitOptions& options,
                                 const StorageOptions& storage) {
  if (options.method.learnK && storage.form == Storage::kCompact)
    throw UsageError(
        "a k for each ellipsoid needs float32 storage; compact storage has one edge for all");
  if (isNarrowBand(input.descriptor, input.source))
    throw UsageError(
        "grid '" + shownName(input.descriptor.name) +
        "' is a level set; the paper's method cannot fit it, because its loss compares windows "
        "that a narrow band does not fill");
  if (const auto tooLarge = tooLargeForSums(input.source)) refuseSums(input, *tooLarge);
  const CancelScope scope(CancelScope::orToken(options.cancel));
  PaperFitResult made = fitByPaper(input.source, options);
  ConvertOptions own;
  static_cast<CommonFitOptions&>(own.fit) = options;
  own.storage = storage;
  const Job job{input, own};
  StoredGrid grid = storedGridOf(job, made.fit);
  grid.curve = withoutTimes(made.fit.curve);
  Conversion conversion = storedAs(job, std::move(made.fit), std::move(grid),
                                   {.loss = CompactOptions{}.loss, .psnr = options.psnr});
  conversion.grid = throughTheFormat(std::move(conversion.grid), nullptr, memoryOf(input.source));
  return {std::move(conversion), std::move(made.record)};
}

}  // namespace
}  // namespace esvr::encode

namespace esvr {

PresetQuality qualityOf(Preset preset) {
  switch (preset) {
    case Preset::kDraft:
      return {.psnr = 32.0, .picturePsnr = 30.0, .surfaceBound = 0.4};
    case Preset::kHigh:
      return {.psnr = 50.0, .picturePsnr = 48.0, .surfaceBound = 0.025};
    case Preset::kStandard:
      break;
  }
  return {.psnr = 40.0, .picturePsnr = 38.0, .surfaceBound = 0.1};
}

Conversion convertVolume(const ConvertInput& input, const ConvertOptions& options) {
  encode::requireQuality(options.goal);
  if (!hasNonFinite(input.source)) return encode::converted(input, options);
  return encode::convertKeepingNonFinite(input, options, encode::converted);
}

PaperConversion convertByPaper(const ConvertInput& input, const PaperFitOptions& options,
                               const StorageOptions& storage) {
  if (!hasNonFinite(input.source)) return encode::convertedByPaper(input, options, storage);
  PaperRecord record;
  ConvertOptions common;
  common.fit.box = options.box;
  Conversion made = encode::convertKeepingNonFinite(
      input, common, [&](const ConvertInput& filled, const ConvertOptions&) {
        PaperConversion byPaper = encode::convertedByPaper(filled, options, storage);
        record = std::move(byPaper.record);
        return std::move(byPaper.conversion);
      });
  return {std::move(made), std::move(record)};
}

}  // namespace esvr
