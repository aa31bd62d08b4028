#include "encode/tone.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <variant>
#include <vector>

#include "core/parallel.h"
#include "encode/ellipsoids.h"
#include "encode/tuning.h"
#include "esvr/encode.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"

namespace esvr::encode {

// ---- What a conversion is judged by

namespace {

/// The goals that have a measure of their own: a preset and a size. The other ones name it.
bool leavesTheMeasure(const Goal& goal) {
  return std::holds_alternative<PresetGoal>(goal) || std::holds_alternative<SizeGoal>(goal);
}

/// dB by which the PSNR of a preset's pictures is lower than that of its values.
constexpr double kPicturesBelowValues = 2.0;

}  // namespace

bool Judge::seesPictures(const ConvertInput& input, const ConvertOptions& options) {
  const bool mayBe = options.measure == Measure::kAuto && leavesTheMeasure(options.goal);
  if (!mayBe && !std::holds_alternative<PictureGoal>(options.goal)) return false;
  return input.source.background == 0.0f &&
         isLookedThrough(input.descriptor.gridClass, input.source) &&
         medianDepth(input.source).has_value();
}

Judge::Judge(const ConvertInput& input, const ConvertOptions& options, ToneCurve tone)
    : values_(input.source),
      tone_(tone),
      range_(activeRange(input.source)),
      halfs_(input.descriptor.valueType == ValueType::kHalf),
      box_{.box = options.fit.box, .peak = options.fit.peak} {
  range_.expand(input.source.background);
  if (!seesPictures(input, options)) return;
  pictures_.emplace(input.source, options.fit.box);
  if (leavesTheMeasure(options.goal))
    valueGain_ = (tone.isOn() ? kTuning.picturesAboveValues : -kPicturesBelowValues) -
                 boxGain(input.source, options.fit.box);
}

/// Turns tones into values, as a reader of the grid does.
void Judge::toValues(SparseVolume& volume) const {
  if (tone_.isOn())
    parallelFor(std::size_t{0}, volume.brickCount(), [&](std::size_t b) {
      for (float& value : volume.brickValues(b))
        value = std::clamp(tone_.value(value), range_.min, range_.max);
    });
  if (halfs_) roundToHalfs(volume);
}

double Judge::operator()(SparseVolume volume) const {
  toValues(volume);
  const auto ofValues = [&] { return psnrOverBox(values_, volume, box_); };
  if (!pictures_) return ofValues();
  const double ofPictures = pictures_->measure(volume).psnr50;
  return valueGain_ ? std::min(ofPictures, ofValues() + *valueGain_) : ofPictures;
}

double Judge::forTones(SparseVolume volume) const {
  toValues(volume);
  const TransmittancePsnr seen = pictures_->measure(volume);
  return 0.5 * (seen.psnr50 + seen.psnr10);
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
  if (high < kTuning.leastToneRange * median) return {};
  return {float(std::cbrt(median * quartile * quartile))};
}

/// The quality of a short fit with a curve, for the comparison of curves.
double qualityWith(ToneCurve tone, const ConvertInput& input, const ConvertOptions& options) {
  const Judge judge(input, options, tone);
  const SparseVolume tones = tone.isOn() ? tonesOf(input.source, tone) : SparseVolume{};
  const ConvertInput toned{input.descriptor, tone.isOn() ? tones : input.source};
  const Attempt made = scoutingFit({toned, options, &judge});
  return judge.forTones(decodeGrid(made.grid, {.memory = memoryOf(input.source)}));
}

}  // namespace

ToneCurve chooseTone(const ConvertInput& input, const ConvertOptions& options) {
  const bool isBounded = std::holds_alternative<BoundGoal>(options.goal) ||
                         std::holds_alternative<LosslessGoal>(options.goal);
  if (isBounded || input.source.background != 0.0f) return {};
  if (options.tone) return *options.tone;
  if (const StoredGrid* previous = options.previous; previous && previous->voxels)
    return previous->tone;
  if (!Judge::seesPictures(input, options)) return {};
  const ToneCurve likely = likelyTone(input.source);
  if (!likely.isOn()) return {};
  const auto gain = unlessCancelled([&] {
    return std::optional(qualityWith(likely, input, options) - qualityWith({}, input, options));
  });
  return gain && *gain > kTuning.toneGain ? likely : ToneCurve{};
}

void setTone(const ConvertInput& input, ToneCurve tone, StoredGrid& grid) {
  const ValueRange range = activeRange(input.source);
  grid.descriptor = input.descriptor;
  grid.valueMin = range.min, grid.valueMax = range.max;
  if (grid.voxels && grid.voxels->form != VoxelForm::kQuantised) return;
  grid.tone = tone;
  if (grid.activeThreshold > 0.0f) grid.activeThreshold = tone.value(grid.activeThreshold);
  const BestSoFar completion;      // a grid that is there is not given up
  std::vector<LayerError> errors;  // The grid has the errors of its tones so far.
  for (std::size_t layers = 1; layers <= grid.layerErrors.size(); ++layers) {
    const VolumeMetrics m = compareVolumes(
        input.source, decodeGrid(firstLayers(grid, layers), {.memory = memoryOf(input.source)}));
    errors.push_back({float(m.psnrBox), float(m.maxError)});
  }
  grid.layerErrors = std::move(errors);
}

}  // namespace esvr::encode
