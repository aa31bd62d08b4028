// Plan: the tone curve and its inverse agree with float64 and with each other to the rounding that docs/math.md
// states, and are odd and monotone. A smoke of a wide range gets a curve and is better seen with it at the same
// size; a volume of a narrow range, a signed one and a bounded one get none. The goals of pictures are reached, and
// the decoded values stay within the range of the source. A curve comes back from a file, and exact voxels have none.
// The total mass is kept. A bound relative to each value holds for signed, tiny and huge values, halfs and backgrounds.

#include "esvr/tone.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include "encode/tone.h"
#include "encode/volumes.h"
#include "esvr/encode.h"
#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"

namespace esvr {
namespace {

TEST(ToneCurve, AgreesWithFloat64) {
  for (const float s : {1e-30f, 0.043f, 7.0f, 1e30f})
    for (const double factor : {0.0, 1e-6, 0.3, 1.0, 12.0, 1e4}) {
      const auto v = float(factor * double(s));
      const ToneCurve tone{s};
      const double u = double(s) * std::asinh(double(v) / double(s));
      EXPECT_FLOAT_EQ(tone.of(v), float(u));
      EXPECT_EQ(tone.of(-v), -tone.of(v));
      // A rounding error of u, which is half of 2^-23 relative to it, is multiplied by the slope cosh(u / s).
      const double bound = 0x1p-23 * (std::abs(u) * std::cosh(u / double(s)) + double(v));
      EXPECT_NEAR(tone.value(tone.of(v)), v, bound);
      EXPECT_EQ(tone.value(-tone.of(v)), -tone.value(tone.of(v)));
    }
}

TEST(ToneCurve, OfScale0IsTheIdentity) {
  const ToneCurve none;
  for (const float v : {-3.0f, 0.0f, 1e-40f, 1e38f}) {
    EXPECT_EQ(none.of(v), v);
    EXPECT_EQ(none.value(v), v);
  }
}

TEST(ToneCurve, BeyondFloat32IsInfinite) {
  EXPECT_EQ(ToneCurve{1.0f}.value(100.0f), HUGE_VALF);
  EXPECT_EQ(ToneCurve{1.0f}.value(-100.0f), -HUGE_VALF);
}

/// Puffs of densities from 0.01 to 10, as smoke has them.
SparseVolume smoke() {
  return test::volumeOf({}, 5, 0.0f, [](Coord v) {
    double sum = 0.0;
    for (int p = 0; p < 7; ++p) {
      const double x = v.x - 20.0 - 9.0 * std::cos(1.9 * p),
                   y = v.y - 20.0 - 9.0 * std::sin(2.3 * p),
                   z = v.z - 20.0 - 9.0 * std::sin(1.1 * p + 1.0);
      const double r = (x * x + y * y + z * z) / (9.0 + 4.0 * p);
      sum += 0.01 * std::pow(10.0, 0.5 * p) * std::exp(-r);
    }
    return sum < 1e-4 ? 0.0f : float(sum);
  });
}

GridDescriptor fog() {
  GridDescriptor descriptor;
  descriptor.gridClass = GridClass::kFogVolume;
  return descriptor;
}

Conversion shortlyFitted(const SparseVolume& volume, ConvertOptions options) {
  options.fit.iterations = 150;
  return convertVolume({fog(), volume}, options);
}

double seen(const SparseVolume& volume, const StoredGrid& grid) {
  return transmittancePsnr(volume, decodeGrid(grid))->psnr50;
}

TEST(Tone, ShowsSmokeBetterInTheSameBytes) {
  const SparseVolume volume = smoke();
  const Conversion with = shortlyFitted(volume, {.goal = SizeGoal{900}});
  const Conversion without = shortlyFitted(volume, {.goal = SizeGoal{900}, .tone = ToneCurve{}});
  EXPECT_TRUE(with.grid.tone.isOn());
  EXPECT_TRUE(with.byPictures);
  EXPECT_FALSE(without.grid.tone.isOn());
  EXPECT_LE(bytesAdded(with.grid), 900u);
  EXPECT_GT(seen(volume, with.grid), seen(volume, without.grid) + 1.0);
}

TEST(Tone, ReachesTheQualityOfPictures) {
  const SparseVolume volume = smoke();
  for (const auto representation : {Representation::kEllipsoids, Representation::kVoxels}) {
    const Conversion made =
        shortlyFitted(volume, {.goal = PictureGoal{33.0}, .representation = representation});
    EXPECT_NE(made.fit.end, FitEnd::kPsnrMissed);
    EXPECT_GE(seen(volume, made.grid), 33.0);
    EXPECT_LE(seen(volume, made.grid), 35.0);
    const ValueRange range = activeRange(volume), back = activeRange(decodeGrid(made.grid));
    EXPECT_GE(back.min, 0.0f);
    EXPECT_LE(back.max, range.max);
    EXPECT_EQ(made.grid.valueMax, range.max);
  }
}

/// Where nothing is seen in the box, the values decide.
TEST(Tone, OfABoxWithoutDepthIsNone) {
  ConvertOptions options{.goal = PresetGoal{}};
  for (const Box box : {Box{{0, 0, 0}, {1, 1, 1}}, Box{{100, 100, 100}, {105, 105, 105}}}) {
    options.fit.box = box;
    const Conversion made = shortlyFitted(smoke(), options);
    EXPECT_FALSE(made.byPictures);
    EXPECT_FALSE(made.grid.tone.isOn());
  }
}

TEST(Tone, OfAFrameIsThatOfTheFrameBefore) {
  SparseVolume volume = smoke();
  ConvertOptions options{.goal = PictureGoal{34.0}, .representation = Representation::kEllipsoids};
  options.tone = ToneCurve{0.3f};
  const Conversion first = shortlyFitted(volume, options);
  options.tone.reset();
  options.previous = &first.grid;
  for (float& v : volume.values) v *= 1.05f;
  const Conversion next = shortlyFitted(volume, options);
  EXPECT_EQ(next.grid.tone.scale, 0.3f);
  EXPECT_GE(seen(volume, next.grid), 33.0);
  // An option decides before the frame does.
  options.tone = ToneCurve{};
  EXPECT_FALSE(shortlyFitted(volume, options).grid.tone.isOn());
}

TEST(Tone, OfAPresetLimitsTheErrorOfValuesToo) {
  const SparseVolume volume = smoke();
  const Conversion made = shortlyFitted(volume, {.goal = PresetGoal{}});
  const VolumeMetrics m = compareVolumes(volume, decodeGrid(made.grid), {.transmittance = true});
  EXPECT_GE(m.transmittance->psnr50, qualityOf(Preset::kStandard).picturePsnr);
  EXPECT_GE(m.psnrActive, qualityOf(Preset::kStandard).picturePsnr - 4.0);
}

TEST(Tone, IsNotUsedWhereItDoesNotServe) {
  const SparseVolume volume = smoke();
  EXPECT_FALSE(shortlyFitted(volume, {.goal = PsnrGoal{35.0}}).grid.tone.isOn());
  EXPECT_FALSE(
      shortlyFitted(volume, {.goal = SizeGoal{900}, .measure = Measure::kValues}).grid.tone.isOn());
  EXPECT_FALSE(shortlyFitted(volume, {.goal = LosslessGoal{}}).grid.tone.isOn());
  EXPECT_FALSE(shortlyFitted(volume, {.goal = BoundGoal{0.01, true}}).grid.tone.isOn());
  const Conversion tube = shortlyFitted(test::tubeVolume(), {.goal = SizeGoal{900}});
  EXPECT_FALSE(tube.grid.tone.isOn());  // its values differ too little
}

TEST(Tone, KeepsAMaskWithTheMass) {
  const SparseVolume volume = smoke();
  const Conversion made = shortlyFitted(volume, {.goal = PictureGoal{30.0},
                                                 .representation = Representation::kEllipsoids,
                                                 .storage = {.activity = Activity::kExact}});
  const SparseVolume decoded = decodeGrid(made.grid);
  EXPECT_EQ(activeVoxelCount(decoded), activeVoxelCount(volume));
  EXPECT_EQ(compareVolumes(volume, decoded).iou, 1.0);
}

/// Values over 30 octaves, of both signs, by tones around the scale and far beyond it. The float32 tones have relative
/// errors of 2^-24 (1 + u / s) in their values, and a judge adds 5e-7.
TEST(Judge, SeesTheValuesOfTones) {
  const SparseVolume source = test::volumeOf({}, 2, -1.0f, [](Coord v) {
    return std::ldexp(1.0f + 0.1f * float(v.y), v.x * 2 - 15) * (v.z % 3 == 0 ? -1.0f : 1.0f);
  });
  GridDescriptor descriptor;
  descriptor.gridClass = GridClass::kFogVolume;
  for (const float scale : {1e-4f, 1.0f, 1e6f}) {
    const encode::Judge judge({descriptor, source}, {}, ToneCurve{scale});
    SparseVolume one = source;
    for (std::size_t b = 0; b < source.brickCount(); ++b) {
      // The masses of single voxels: the others are 0.
      for (const std::size_t v : {0u, 77u, 300u, 511u}) {
        std::ranges::fill(one.values, 0.0f);
        const float value = source.brickValues(b)[v];
        one.brickValues(b)[v] = ToneCurve{scale}.of(value);
        const double rounding = (1.0 + std::abs(double(one.brickValues(b)[v])) / scale) * 0x1p-24;
        EXPECT_NEAR(judge.massOf(one), value, (5e-7 + 2.0 * rounding) * std::abs(value));
      }
    }
  }
}

TEST(Tone, KeepsTheTotalMass) {
  const SparseVolume volume = smoke();
  for (const auto representation : {Representation::kEllipsoids, Representation::kVoxels}) {
    const Conversion made =
        shortlyFitted(volume, {.goal = PictureGoal{30.0}, .representation = representation});
    const VolumeMetrics m = compareVolumes(volume, decodeGrid(made.grid));
    EXPECT_NEAR(m.massCandidate / m.massReference, 1.0, 1e-3);
  }
}

TEST(Tone, AndMassKeepValuesNearTheLargestFloatFinite) {
  const SparseVolume volume = test::volumeOf({}, 5, 0.0f, [](Coord v) {
    return float(3.3e38 * std::sin(0.4 * v.x) * std::cos(0.3 * v.y) * std::sin(0.2 * v.z));
  });
  for (const Goal& goal : std::vector<Goal>{PresetGoal{}, PictureGoal{38.0}, SizeGoal{900}})
    EXPECT_FALSE(hasNonFinite(decodeGrid(shortlyFitted(volume, {.goal = goal}).grid)));
}

/// The largest error relative to max(|v|, floor).
double relativeError(const SparseVolume& volume, const SparseVolume& decoded, double floor) {
  double largest = 0.0;
  for (std::size_t b = 0; b < volume.brickCount(); ++b) {
    const auto other = findBrick(decoded, brickOf(volume.brickCorner(b) - decoded.origin));
    for (std::size_t v = 0; v < kBrickVoxels; ++v) {
      const double value = volume.brickValues(b)[v];
      const double made = other ? decoded.brickValues(*other)[v] : decoded.background;
      if (made != value)
        largest = std::max(largest, std::abs(made - value) / std::max(std::abs(value), floor));
    }
  }
  return largest;
}

TEST(RelativeBound, HoldsAtEveryVoxel) {
  SparseVolume volume = smoke();
  for (std::size_t b = 0; b < volume.brickCount(); b += 2)
    for (float& value : volume.brickValues(b)) value = -value;
  for (const double share : {0.2, 0.01, 1e-4})
    for (const double floor : {1e-4, 0.03, 5.0}) {
      const Conversion made = shortlyFitted(volume, {.goal = RelativeBoundGoal{share, floor}});
      EXPECT_LE(relativeError(volume, decodeGrid(made.grid), floor), share);
      EXPECT_GT(relativeError(volume, decodeGrid(made.grid), floor), 0.3 * share);
    }
}

TEST(RelativeBound, HoldsForHalfs) {
  SparseVolume volume = smoke();
  roundToHalfs(volume);
  GridDescriptor descriptor = fog();
  descriptor.valueType = ValueType::kHalf;
  std::uint64_t before = 0;
  for (const double share : {1e-5, 3e-4, 1e-3, 0.01, 0.1}) {
    const Conversion made =
        convertVolume({descriptor, volume}, {.goal = RelativeBoundGoal{share, 1e-3}});
    EXPECT_LE(relativeError(volume, decodeGrid(made.grid), 1e-3), share);
    if (before > 0) {
      EXPECT_LE(bytesAdded(made.grid), before);
    }
    before = bytesAdded(made.grid);
  }
}

TEST(RelativeBound, OfTinyAndHugeValues) {
  SparseVolume volume = smoke();
  std::size_t n = 0;
  for (float& value : volume.values)
    if (value != 0.0f) value = std::ldexp(value, int(n++ % 240) - 120);
  *std::ranges::find_if(volume.values, [](float v) { return v != 0.0f; }) = 1e-45f;
  for (const std::optional<double> floor : {std::optional<double>{}, {1e-30}, {1e30}}) {
    const Conversion made = shortlyFitted(volume, {.goal = RelativeBoundGoal{0.01, floor}});
    EXPECT_LE(relativeError(volume, decodeGrid(made.grid), floor.value_or(0x1p-126)), 0.01);
  }
}

// The smallest floats have few digits, so that no curve reaches down to them, and exact voxels would take several times
// the bytes.
TEST(RelativeBound, IsThatOfNormalFloatsWhereThereAreSome) {
  SparseVolume volume = smoke();
  const Conversion usual = shortlyFitted(volume, {.goal = RelativeBoundGoal{0.01, 0x1p-126}});
  std::size_t n = 0;
  for (float& value : volume.values)
    if (value != 0.0f && n++ % 50 == 0) value *= 0x1p-140f;
  const Conversion made = shortlyFitted(volume, {.goal = RelativeBoundGoal{0.01}});
  EXPECT_TRUE(made.grid.tone.isOn());
  EXPECT_LE(relativeError(volume, decodeGrid(made.grid), 0x1p-126), 0.01);
  EXPECT_LT(bytesAdded(made.grid), 2 * bytesAdded(usual.grid)) << "although a fiftieth is noise";
  for (float& value : volume.values) value *= value < 1e-30f ? 1.0f : 0x1p-140f;
  const Conversion small = shortlyFitted(volume, {.goal = RelativeBoundGoal{0.01}});
  EXPECT_LE(relativeError(volume, decodeGrid(small.grid), 0x1p-149), 0.01) << "none is normal";
}

TEST(RelativeBound, WithABackgroundIsThatOfTheSmallestValue) {
  SparseVolume volume = smoke();
  for (float& value : volume.values) value += 280.0f;
  setBackground(280.0f, volume);
  const Conversion made = shortlyFitted(volume, {.goal = RelativeBoundGoal{0.001}});
  EXPECT_FALSE(made.grid.tone.isOn());
  EXPECT_LE(relativeError(volume, decodeGrid(made.grid), 1.0), 0.001);
}

TEST(Quality, IsFiniteAndNotNegative) {
  const SparseVolume volume = smoke();
  for (const double psnr : {-1.0, double(NAN), double(INFINITY)})
    for (const Goal& goal : {Goal(PsnrGoal{psnr}), Goal(PictureGoal{psnr})})
      EXPECT_THROW((void)convertVolume({fog(), volume}, {.goal = goal}), UsageError) << psnr;
}

TEST(RelativeBound, RefusesWhatIsNoBound) {
  const SparseVolume volume = smoke();
  for (const auto& goal : {RelativeBoundGoal{0.0}, RelativeBoundGoal{1.0}, RelativeBoundGoal{NAN},
                           RelativeBoundGoal{0.1, 0.0}, RelativeBoundGoal{0.1, 1e300}})
    EXPECT_THROW((void)shortlyFitted(volume, {.goal = goal}), UsageError);
  EXPECT_THROW((void)shortlyFitted(volume, {.goal = RelativeBoundGoal{0.1},
                                            .representation = Representation::kEllipsoids}),
               UsageError);
}

TEST(Tone, OfAGivenScaleServesSignedValues) {
  SparseVolume volume = smoke();
  for (std::size_t b = 0; b < volume.brickCount(); ++b)
    if (volume.bricks[b].x % 2 == 0)
      for (float& value : volume.brickValues(b)) value = -value;
  const Conversion made = shortlyFitted(volume, {.goal = PsnrGoal{35.0}, .tone = ToneCurve{0.1f}});
  EXPECT_EQ(made.grid.tone, ToneCurve{0.1f});
  EXPECT_FALSE(made.byPictures);
  EXPECT_GE(compareVolumes(volume, decodeGrid(made.grid)).psnrBox, 35.0);
}

TEST(Tone, LayersHaveTheErrorsOfTheBoxOfTheConversion) {
  const SparseVolume volume = smoke();
  ConvertOptions options{.goal = FitGoal{}, .tone = ToneCurve{0.3f}};
  options.fit.box = Box{{8, 8, 8}, {23, 23, 23}};
  options.fit.count = 3000;
  options.representation = Representation::kEllipsoids;
  options.fit.iterations = 40;
  const StoredGrid grid = convertVolume({fog(), volume}, options).grid;
  ASSERT_GE(layerCount(grid), 2u);
  ASSERT_EQ(grid.layerErrors.size(), layerCount(grid));
  for (std::size_t k = 1; k <= layerCount(grid); ++k) {
    const auto metrics =
        compareVolumes(volume, decodeGrid(firstLayers(grid, k)), {.box = options.fit.box});
    EXPECT_EQ(grid.layerErrors[k - 1].psnrBox, float(metrics.psnrBox));
    EXPECT_EQ(grid.layerErrors[k - 1].maxError, float(metrics.maxError));
  }
}

TEST(Tone, ComesBackFromAFile) {
  const SparseVolume volume = smoke();
  for (const auto representation : {Representation::kEllipsoids, Representation::kVoxels}) {
    const Conversion made =
        shortlyFitted(volume, {.goal = SizeGoal{1500}, .representation = representation});
    EsvrFile file;
    file.grids.push_back(made.grid);
    const EsvrFile back = decodeEsvr(encodeEsvr(file), "memory");
    EXPECT_EQ(back.grids[0].tone, made.grid.tone);
    EXPECT_EQ(decodeGrid(back.grids[0]).values, decodeGrid(made.grid).values);
  }
}

}  // namespace
}  // namespace esvr
