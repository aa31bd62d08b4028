#include "encode/tone.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <span>
#include <utility>
#include <variant>
#include <vector>

#include "core/parallel.h"
#include "encode/ellipsoids.h"
#include "encode/voxels.h"
#include "esvr/encode.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"
#include "esvr/resolution.h"
#include "field/voxel_rule.h"
#include "format/grid_rule.h"

namespace esvr::encode {

// ---- What a conversion is judged by

namespace {

/// The goals that have a measure of their own: a preset and a size. The other ones name it.
bool leavesTheMeasure(const Goal& goal) {
  return std::holds_alternative<PresetGoal>(goal) || std::holds_alternative<SizeGoal>(goal);
}

/// dB by which the PSNR of a preset's pictures is lower than that of its values.
constexpr double kPicturesBelowValues = 2.0;
/// dB by which the PSNR over the active voxels may be lower than that of the transmittance, where a tone curve is used.
/// Cycles shows smoke1 with 34 dB over the active voxels at 41 to 43 dB (docs/convert.md).
constexpr double kPicturesAboveValues = 4.0;
/// The ninth decile of the active values relative to their median from which on a tone curve is tried, and the dB by which
/// it must be better.
constexpr double kLeastToneRange = 3.0, kToneGain = 0.1;
/// dB by which the quality that is judged must be higher where its pictures are up to this number of dB worse. Without a
/// curve, one of 16 frames of a plume took 9.5 KB instead of 4.3, for a quality of 35.5 dB instead of 40.5 and pictures
/// that are 0.1 dB better.
constexpr double kToneQualityGain = 2.0, kMostToneLoss = 0.5;

/// The sum of ofBrick(values) over the bricks, in an order that does not depend on the number of threads.
template <class OfBrick>
double sumOfBricks(const SparseVolume& volume, const OfBrick& ofBrick) {
  std::vector<double> parts(volume.brickCount());
  parallelFor(std::size_t{0}, parts.size(),
              [&](std::size_t b) { parts[b] = ofBrick(volume.brickValues(b)); });
  return std::accumulate(parts.begin(), parts.end(), 0.0);
}

/// The sum over a brick, in the lanes of SIMD vectors.
double sumOf(std::span<const float> values) {
  constexpr std::size_t kLanes = 8;
  double lanes[kLanes] = {};
  for (std::size_t v = 0; v < kBrickVoxels; v += kLanes)
    for (std::size_t k = 0; k < kLanes; ++k) lanes[k] += double(values[v + k]);
  return std::accumulate(lanes, lanes + kLanes, 0.0);
}

/// sinh(x) with a relative error below 5e-7, for |x| below 89. The loops that call it become vector instructions.
float quickSinh(float x) {
  constexpr float kLog2e = 1.44269504f, kLn2High = 0.693145752f, kLn2Low = 1.42860677e-6f;
  constexpr float kRound = 0x1.8p23f;  // adding it rounds to an integer in the low bits
  const float magnitude = std::min(std::abs(x), 89.0f), square = x * x;
  // Below 1, the series; above, the exponential function of the magnitude, of which half is 2^(n - 1) p.
  const float series =
      x + x * square *
              (1.6666667e-1f +
               square * (8.333333e-3f + square * (1.984127e-4f + square * 2.755732e-6f)));
  const float shifted = magnitude * kLog2e + kRound, n = shifted - kRound;
  const float f = (magnitude - n * kLn2High) - n * kLn2Low;
  float p = f * 1.388889e-3f + 8.333334e-3f;
  p = p * f + 4.1666668e-2f;
  p = p * f + 1.6666667e-1f;
  p = p * f + 0.5f;
  p = p * f + 1.0f;
  p = p * f + 1.0f;
  const float half = std::bit_cast<float>(std::bit_cast<std::int32_t>(p) +
                                          ((std::bit_cast<std::int32_t>(shifted) - 1) << 23));
  const float large = std::copysign(half - 0.25f / half, x);
  return magnitude < 1.0f ? series : large;
}

}  // namespace

void forgiveFilled(const SparseVolume& source, const VoxelLayer* filled, SparseVolume& volume) {
  if (!filled) return;
  parallelFor(std::size_t{0}, filled->bricks.size(), [&](std::size_t b) {
    const Coord corner = filled->origin + filled->bricks[b] * kBrickSide;
    const auto to = brickWith(volume, corner);
    const auto from = brickWith(source, corner);
    if (!to || !from) return;
    forEachActive(filled->active[b], [&](int v) {
      volume.brickValues(*to)[std::size_t(v)] = source.brickValues(*from)[std::size_t(v)];
    });
  });
}

bool Judge::seesPictures(const ConvertInput& input, const ConvertOptions& options) {
  const bool mayBe = options.measure == Measure::kAuto && leavesTheMeasure(options.goal);
  if (!mayBe && !std::holds_alternative<PictureGoal>(options.goal)) return false;
  return input.source.background == 0.0f &&
         isLookedThrough(input.descriptor.gridClass, input.source) &&
         medianDepth(input.source, options.fit.box).has_value();
}

Judge::Judge(const ConvertInput& input, const ConvertOptions& options, ToneCurve tone)
    : values_(input.source),
      filled_(options.filled),
      tone_(tone),
      range_(activeRange(input.source)),
      halfs_(input.descriptor.valueType == ValueType::kHalf),
      box_{.box = options.fit.box,
           .peak = options.fit.peak ? *options.fit.peak : peakOf(input.source)} {
  range_.expand(input.source.background);
  if (!seesPictures(input, options)) return;
  pictures_.emplace(input.source, options.fit.box);
  mass_ = sumOfBricks(input.source, sumOf);
  if (leavesTheMeasure(options.goal))
    valueGain_ = (tone.isOn() ? kPicturesAboveValues : -kPicturesBelowValues) -
                 boxGain(input.source, options);
}

/// The values of a brick's tones, times a factor, as a reader of the grid gets them but for the last bits.
void Judge::toValues(std::span<const float> tones, float factor, std::span<float> values) const {
  const float s = tone_.scale, inverse = s > 0.0f ? factor / s : 0.0f;
  const auto clamped = [low = range_.min, high = range_.max](float value) {
    return value < low ? low : high < value ? high : value;
  };
  const float* const __restrict from = tones.data();
  float* const __restrict to = values.data();
  if (tone_.isOn())
    for (int v = 0; v < kBrickVoxels; ++v) to[v] = clamped(s * quickSinh(from[v] * inverse));
  else
    for (int v = 0; v < kBrickVoxels; ++v) to[v] = clamped(from[v] * factor);
}

/// Turns tones into values.
void Judge::toValues(SparseVolume& volume) const {
  if (tone_.isOn())
    parallelFor(std::size_t{0}, volume.brickCount(), [&](std::size_t b) {
      float values[kBrickVoxels];
      toValues(volume.brickValues(b), 1.0f, values);
      std::ranges::copy(values, volume.brickValues(b).begin());
    });
  if (halfs_) roundToHalfs(volume);
}

Judge::Judgement Judge::operator()(SparseVolume volume) const {
  toValues(volume);
  forgiveFilled(values_, filled_, volume);
  const auto ofValues = [&] { return psnrOverBox(values_, volume, box_); };
  if (!pictures_) return {ofValues()};
  // Rounding or the factor of the mass has taken values near the largest float beyond it.
  constexpr double kUseless = -std::numeric_limits<double>::infinity();
  if (hasNonFinite(volume)) return {kUseless, kUseless};
  const TransmittancePsnr seen = pictures_->measure(volume);
  return {valueGain_ ? std::min(seen.psnr50, ofValues() + *valueGain_) : seen.psnr50,
          0.5 * (seen.psnr50 + seen.psnr10)};
}

// ---- The total mass

// A reader may round the values to halfs, which changes sums of many of them by much less than what is kept here.
Judge::Mass Judge::growingMass(const SparseVolume& tones, double factor) const {
  const float inverse = tone_.isOn() ? 1.0f / tone_.scale : 0.0f;
  std::vector<Mass> parts(tones.brickCount());
  parallelFor(std::size_t{0}, parts.size(), [&](std::size_t b) {
    const auto from = tones.brickValues(b);
    float values[kBrickVoxels], growth[kBrickVoxels];
    toValues(from, float(factor), values);
    // The derivative of s sinh(f t / s) by f is t cosh(f t / s). Values that are clamped do not grow.
    for (int v = 0; v < kBrickVoxels; ++v) {
      const float sinh = values[v] * inverse;
      const bool isInside = values[v] > range_.min && values[v] < range_.max;
      growth[v] = isInside ? from[std::size_t(v)] * std::sqrt(1.0f + sinh * sinh) : 0.0f;
    }
    parts[b] = {sumOf(values), sumOf(growth)};
  });
  Mass mass;
  for (const Mass& part : parts) mass.total += part.total, mass.growth += part.growth;
  return mass;
}

double Judge::massFactor(double wanted, const SparseVolume& decoded) const {
  // Newton's method. A factor farther from 1 would change what is seen more than the missing mass does.
  constexpr int kSteps = 5;
  constexpr double kMostChange = 0.05, kEnough = 1e-5;
  double factor = 1.0;
  for (int n = 0; n < kSteps; ++n) {
    const Mass mass = growingMass(decoded, factor);
    const double change = (wanted - mass.total) / mass.growth;
    if (!(std::abs(factor + change - 1.0) <= kMostChange)) break;
    factor += change;
    if (std::abs(change) < kEnough) break;
  }
  return factor;
}

namespace {

/// While it lives, the decoded values of a grid are not clamped to the range of the source.
struct Unclamped {
  explicit Unclamped(StoredGrid& given) : grid(given), before(given.withinRange) {
    grid.withinRange = false;
  }
  ~Unclamped() { grid.withinRange = before; }
  Unclamped(const Unclamped&) = delete;
  Unclamped& operator=(const Unclamped&) = delete;

  StoredGrid& grid;
  bool before;
};

}  // namespace

double keepMass(const Job& job, StoredGrid& grid) {
  const auto decoded = [&] { return decodeGrid(grid, {.memory = memoryOf(job.input.source)}); };
  if (!seesPictures(job) || grid.quantised.empty()) return psnrOf(job, decoded());
  SparseVolume sums = [&] {
    const Unclamped sumsGrowWithTheFactor(grid);
    return decoded();
  }();
  const double factor = job.judge->massFactor(job.judge->mass(), sums);
  for (std::size_t c = 0; c < grid.quantised.size(); ++c) {
    grid.quantised[c].lattice.intensityStep *= factor;
    grid.field.chunks[c].ellipsoids = dequantise(grid.quantised[c]);
  }
  // A negative threshold, by which all voxels are active, may be the lowest float.
  if (grid.activeThreshold > 0.0f) grid.activeThreshold = float(grid.activeThreshold * factor);
  const VoxelRule rule = format::ruleOf(grid);
  parallelFor(std::size_t{0}, sums.brickCount(), [&](std::size_t b) {
    for (float& sum : sums.brickValues(b)) sum = rule.settled(float(sum * factor));
  });
  return psnrOf(job, std::move(sums));
}

// ---- The tone curve

SparseVolume tonesOf(const SparseVolume& volume, ToneCurve tone) {
  SparseVolume tones = volume;
  parallelFor(std::size_t{0}, tones.brickCount(), [&](std::size_t b) {
    for (float& value : tones.brickValues(b)) value = tone.of(value);
  });
  return tones;
}

namespace {

/// The curve that may suit a volume; none if its values differ too little. The scale is between the median
/// and the third quartile of the active values: a smaller one spends bits on faint voxels that nobody
/// sees, and a larger one has no effect. The weights are those with which smoke1, gas_0006, the fire and
/// the plume take the fewest bytes by default, of the two or three that were tried for each.
ToneCurve likelyTone(const SparseVolume& volume) {
  constexpr std::size_t kMostSamples = std::size_t{1} << 20;
  const std::size_t stride = volume.values.size() / kMostSamples + 1;
  std::vector<float> values;
  for (std::size_t i = 0; i < volume.values.size(); i += stride)
    if (volume.active[i / kBrickVoxels].test(int(i % kBrickVoxels)) && volume.values[i] != 0.0f)
      values.push_back(std::abs(volume.values[i]));
  if (values.empty()) return {};
  const auto quantile = [&](double share) {
    const auto at = values.begin() + std::ptrdiff_t(share * double(values.size() - 1));
    std::nth_element(values.begin(), at, values.end());
    return double(*at);
  };
  const double median = quantile(0.5), quartile = quantile(0.75), high = quantile(0.9);
  if (high < kLeastToneRange * median) return {};
  return {float(std::cbrt(median * quartile * quartile))};
}

/// What a short fit with a curve shows.
struct Scouted {
  FitPoint point;  ///< with the quality that is judged
  double forTones = 0.0;
};

/// True if a curve is better than none: pictures of thin and of dense smoke are, or the quality that is judged is much
/// higher and they are nearly as good.
bool isBetter(const Scouted& with, const Scouted& without) {
  const double pictures = with.forTones - without.forTones;
  const double quality = with.point.psnr - without.point.psnr;
  return pictures > kToneGain || (quality > kToneQualityGain && pictures > -kMostToneLoss);
}

Scouted scouted(ToneCurve tone, const ConvertInput& input, const ConvertOptions& options,
                double count) {
  const Judge judge(input, options, tone);
  const SparseVolume tones = tone.isOn() ? tonesOf(input.source, tone) : SparseVolume{};
  const ConvertInput toned{input.descriptor, tone.isOn() ? tones : input.source};
  const Attempt fit = shortFitOf({toned, options, &judge}, count);
  return {{double(fit.asked), fit.psnr}, fit.forTones};
}

/// Chooses between a curve and none by short fits. Where ellipsoids are large, the averages of 2^3 voxels show which one is
/// better in a fifth of the time (Lab, "Where a search goes").
ToneChoice chosenByFits(ToneCurve likely, const ConvertInput& given,
                        const ConvertOptions& givenOptions) {
  constexpr int kCoarser = 2;
  constexpr double kVoxelsEach = 50.0;
  constexpr double kAveragesAbove = 2.0;  // dB of what is seen: plumes 1.5 to 2.4, smoke1 3.3
  const double count = scoutCount({given, givenOptions});
  const double voxels = double(activeVoxelCount(given.source)) / (kCoarser * kCoarser * kCoarser);
  const bool areLarge = voxels >= kVoxelsEach * count && !givenOptions.fit.box;
  const SparseVolume coarse = areLarge ? coarsened(given.source, kCoarser) : SparseVolume{};
  const bool isCoarse = areLarge && Judge::seesPictures({given.descriptor, coarse}, givenOptions);
  const ConvertInput input{given.descriptor, isCoarse ? coarse : given.source};
  ConvertOptions options = givenOptions;
  // The averages have the filled voxels in other places. Their values are smooth, and may count here.
  if (isCoarse) options.filled = nullptr;
  const Scouted with = scouted(likely, input, options, count),
                without = scouted({}, input, options, count);
  const bool isOn = isBetter(with, without);
  ToneChoice choice{isOn ? likely : ToneCurve{}, isOn ? with.point : without.point};
  if (isCoarse) choice.scout->psnr -= kAveragesAbove;
  return choice;
}

}  // namespace

ToneChoice chooseTone(const ConvertInput& input, const ConvertOptions& options) {
  const bool isBounded = std::holds_alternative<BoundGoal>(options.goal) ||
                         std::holds_alternative<RelativeBoundGoal>(options.goal) ||
                         std::holds_alternative<LosslessGoal>(options.goal);
  if (isBounded || input.source.background != 0.0f) return {};
  if (options.tone) return {*options.tone};
  if (const StoredGrid* previous = options.previous; previous && previous->voxels)
    return {previous->tone};
  if (!Judge::seesPictures(input, options)) return {};
  const ToneCurve likely = likelyTone(input.source);
  if (!likely.isOn()) return {};
  // At the least effort, two short fits would take longer than all else: 0.11 instead of 0.05 s for the density of gas_0004.
  constexpr std::uint64_t kSmallVolume = std::uint64_t{1} << 16;
  if (options.effort == kLeastEffort && activeVoxelCount(input.source) < kSmallVolume)
    return {likely};
  const auto choice =
      unlessCancelled([&] { return std::optional(chosenByFits(likely, input, options)); });
  return choice.value_or(ToneChoice{});
}

void setTone(const ConvertInput& input, ToneCurve tone, StoredGrid& grid) {
  const ValueRange range = activeRange(input.source);
  grid.descriptor = input.descriptor;
  grid.valueMin = range.min, grid.valueMax = range.max;
  if (grid.voxels && grid.voxels->form != VoxelForm::kQuantised) return;
  grid.tone = tone;
  if (grid.activeThreshold > 0.0f) grid.activeThreshold = tone.value(grid.activeThreshold);
}

// ---- A bound relative to each value

namespace {

/// The smallest magnitude of an active value.
double leastOf(const SparseVolume& volume) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t b = 0; b < volume.brickCount(); ++b)
    for (int v = 0; v < kBrickVoxels; ++v)
      if (volume.active[b].test(v))
        least = std::min(least, std::abs(double(volume.brickValues(b)[std::size_t(v)])));
  return least;
}

/// The shares within which the values of a lattice should be, so that they keep to a bound after they are rounded
/// to what a reader gets: the first usually does, and the others are safer.
std::vector<double> sharesBeforeRounding(double share, double floor, DecodedValues decoded) {
  if (decoded == DecodedValues::kFloats) return {share - 0x1p-23};
  // The source's values are halfs, m times as large as the distance u of halfs around them. A value
  // within (floor(share m) + 1/2) u is rounded to a half within the bound, unless it lies beyond a
  // power of 2, where halfs are farther apart.
  constexpr double kLeastApart = 0x1p-24, kFirst = 1024.0, kLast = 2048.0;
  double before = share;
  for (double m = std::clamp(std::floor(floor / kLeastApart), 1.0, kFirst); m <= kLast; m += 1.0)
    before = std::min(before, (std::floor(share * m) + 0.5) / m);
  return {before, share - 0x1p-10};
}

/// What a reader gets from a layer of tones. \param range  of the source's active values
SparseVolume decodedTones(const VoxelLayer& layer, ToneCurve tone, const ValueRange& range,
                          DecodedValues decoded) {
  SparseVolume volume = volumeOf(layer);
  for (float& value : volume.values) value = std::clamp(tone.value(value), range.min, range.max);
  if (decoded == DecodedValues::kHalfs) roundToHalfs(volume);
  return volume;
}

}  // namespace

RelativeLayer relativeLayer(const Job& job, const RelativeBoundGoal& goal) {
  const SparseVolume& source = job.input.source;
  const double least = leastMagnitude(source);
  if (!std::isfinite(least)) return {smallestExactLayer(source), {}};
  double floor = goal.floor.value_or(least);
  if (source.background != 0.0f)
    return {boundedLayer(source, goal.share * std::max(floor, leastOf(source)), voxelActivity(job),
                         voxelSigns(job), decodedValues(job)),
            {}};
  // Frames of a sequence are predicted from each other where they have one curve.
  const StoredGrid* previous = job.options.previous;
  if (previous && previous->tone.isOn() && double(previous->tone.scale) <= floor)
    floor = previous->tone.scale;
  ToneCurve tone{float(floor)};
  if (double(tone.scale) > floor) tone.scale = std::nextafter(tone.scale, 0.0f);
  floor = tone.scale;
  if (!(floor > 0.0)) return {smallestExactLayer(source), {}};
  // A step of u moves a value by step sqrt(v^2 + floor^2), which is the largest share of
  // max(v, floor) at the floor. There, the half step takes it to floor (1 + share).
  const SparseVolume tones = tonesOf(source, tone);
  const ValueRange range = activeRange(tones);
  const double rounded = double(std::max(-range.min, range.max)) * 0x1p-23;
  ValueRange values = activeRange(source);
  values.expand(source.background);
  for (const double share : sharesBeforeRounding(goal.share, floor, decodedValues(job))) {
    const double halfStep = floor * (std::asinh(1.0 + share) - std::asinh(1.0)) - rounded;
    if (!(halfStep > rounded)) continue;
    VoxelLayer layer = boundedLayer(tones, halfStep, voxelActivity(job), voxelSigns(job));
    if (layer.form != VoxelForm::kQuantised) break;
    const auto decoded = decodedTones(layer, tone, values, decodedValues(job));
    if (largestRelativeError(source, decoded, floor).share <= goal.share)
      return {std::move(layer), tone};
  }
  return {smallestExactLayer(source), {}};
}

void requireRelativeBound(const ConvertInput& input, const SparseVolume& decoded,
                          const RelativeBoundGoal& goal) {
  const RelativeError largest = largestRelativeError(input.source, decoded, goal.floor);
  if (largest.share > goal.share)
    throw RuntimeFailure("grid '" + shownName(input.descriptor.name) + "': the error at " +
                         toString(largest.at) + " exceeds the bound relative to the value there");
}

}  // namespace esvr::encode
