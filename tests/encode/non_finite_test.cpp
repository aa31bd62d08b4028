// Plan: a ball has NaN and infinities at single voxels, in a whole brick, and at the border. For every goal and both
// representations, they come back exactly where they were, and only there, and the other voxels keep the promise of the
// goal, which compareVolumes() measures without them. Volumes without such voxels are converted as before. Values that
// are filled in are means or copies of neighbours and never leave the range of the others. A sequence stores places that
// do not change once.

#include "encode/non_finite.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "../field/random_field.h"
#include "../fit/volumes.h"
#include "encode/tone.h"
#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"
#include "format/non_finite_section.h"
#include "support/non_finite.h"

namespace esvr {
namespace {

using encode::Filling;
using encode::withFilledVoxels;
using test::kInf;
using test::kNan;
using testing::HasSubstr;
using testing::ThrowsMessage;

/// A soft ball of 24^3 voxels in which other values are set at some voxels.
SparseVolume ballWith(const std::function<float(Coord, float)>& change) {
  return test::volumeOf({8, 0, -8}, 3, 0.0f, [&](Coord v) {
    const double x = v.x - 20.0, y = v.y - 12.0, z = v.z - 4.0;
    const double r2 = (x * x + y * y + z * z) / 100.0;
    return change(v, float(std::max(1.0 - r2, 0.0)));
  });
}

/// NaN in every 23rd voxel and in a brick, an infinity and a minus infinity.
float damaged(Coord v, float value) {
  if (v == Coord{20, 12, 4}) return kInf;
  if (v == Coord{21, 12, 4}) return -kInf;
  if (v.x >= 16 && v.y >= 16 && v.z >= 8) return kNan;
  return (v.x + 3 * v.y + 7 * v.z) % 23 == 0 ? kNan : value;
}

SparseVolume damagedBall() { return ballWith(damaged); }

/// The number of voxels of either volume that are not finite, or -1 if they are not the same.
int equalNonFinite(const SparseVolume& a, const SparseVolume& b) {
  int count = 0;
  const auto kind = [](float v) {
    return std::isfinite(v) ? 0 : std::isnan(v) ? 1 : v > 0 ? 2 : 3;
  };
  for (const SparseVolume* volume : {&a, &b})
    for (std::size_t n = 0; n < volume->values.size(); ++n) {
      const Coord at = volume->brickCorner(n / kBrickVoxels) + voxelLocal(int(n % kBrickVoxels));
      if (kind(valueAt(a, at)) != kind(valueAt(b, at))) return -1;
      if (kind(volume->values[n]) == 0) continue;
      if (!volume->active[n / kBrickVoxels].test(int(n % kBrickVoxels))) return -1;
      ++count;
    }
  return count / 2;
}

/// Checks what a goal promises of the other voxels.
void expectPromise(const Goal& goal, const SparseVolume& source, const StoredGrid& grid) {
  const SparseVolume decoded = decodeGrid(grid);
  const VolumeMetrics m = compareVolumes(source, decoded);
  if (const auto* psnr = std::get_if<PsnrGoal>(&goal)) {
    EXPECT_GE(m.psnrBox, psnr->psnr);
  } else if (const auto* bound = std::get_if<BoundGoal>(&goal)) {
    EXPECT_LE(m.maxError, bound->bound);
  } else if (const auto* relative = std::get_if<RelativeBoundGoal>(&goal)) {
    EXPECT_LE(largestRelativeError(source, decoded, relative->floor).share, relative->share);
  } else if (std::holds_alternative<LosslessGoal>(goal)) {
    EXPECT_EQ(m.maxError, 0.0);
  } else if (const auto* size = std::get_if<SizeGoal>(&goal)) {
    EXPECT_LE(bytesAdded(grid), size->bytes);
  }
}

struct Case {
  const char* name;
  Goal goal;
  Representation representation = Representation::kAuto;
  ValueType valueType = ValueType::kFloat;
};

class KeepsNonFinite : public testing::TestWithParam<Case> {};

TEST_P(KeepsNonFinite, WhereTheyWere) {
  SparseVolume source = damagedBall();
  if (GetParam().valueType == ValueType::kHalf) roundToHalfs(source);
  // Halfs have infinities, which roundToHalfs() makes finite.
  if (GetParam().valueType == ValueType::kHalf)
    for (const Coord at : {Coord{20, 12, 4}, Coord{21, 12, 4}})
      source.brickValues(*findBrick(
          source, brickOf(at - source.origin)))[voxelOffset(localOf(at))] = damaged(at, 0.0f);
  GridDescriptor descriptor;
  descriptor.valueType = GetParam().valueType;
  ConvertOptions options;
  options.goal = GetParam().goal;
  options.representation = GetParam().representation;
  options.fit.iterations = 60;
  options.fit.count = 60;
  const Conversion made = convertVolume({descriptor, source}, options);

  EsvrFile file;
  file.grids.push_back(made.grid);
  const StoredGrid read = decodeEsvr(encodeEsvr(file), "f").grids.front();
  const SparseVolume decoded = decodeGrid(read);
  const int expected = equalNonFinite(source, source);
  EXPECT_GT(expected, 900);
  EXPECT_EQ(equalNonFinite(source, decoded), expected);
  EXPECT_EQ(read.nonFinite.total(), std::uint64_t(expected));
  EXPECT_EQ(read.nonFinite.plusInfinity, 1u);
  EXPECT_EQ(read.nonFinite.minusInfinity, 1u);

  const VolumeMetrics m = compareVolumes(source, decoded);
  EXPECT_EQ(m.nonFinite, std::uint64_t(expected));
  EXPECT_EQ(m.activeVoxels, activeVoxelCount(source) - std::uint64_t(expected));
  expectPromise(GetParam().goal, source, read);

  const SparseVolume drawn = decodeGrid(read, {.keepsNonFinite = false});
  EXPECT_FALSE(hasNonFinite(drawn));
  EXPECT_EQ(valueAt(drawn, {20, 12, 4}), 0.0f);
}

INSTANTIATE_TEST_SUITE_P(
    Goals, KeepsNonFinite,
    testing::Values(Case{"preset", PresetGoal{}}, Case{"fit", FitGoal{}},
                    Case{"ellipsoids", PsnrGoal{22.0}, Representation::kEllipsoids},
                    Case{"voxels", PsnrGoal{45.0}, Representation::kVoxels},
                    Case{"size", SizeGoal{4000}}, Case{"bound", BoundGoal{0.01}},
                    Case{"exact", BoundGoal{0.0}}, Case{"relative", RelativeBoundGoal{0.02, 0.01}},
                    Case{"lossless", LosslessGoal{}},
                    Case{"halfs", BoundGoal{0.01}, Representation::kAuto, ValueType::kHalf},
                    Case{"lossless_halfs", LosslessGoal{}, Representation::kAuto, ValueType::kHalf},
                    Case{"doubles", BoundGoal{0.01}, Representation::kAuto, ValueType::kDouble}),
    [](const auto& tested) { return std::string(tested.param.name); });

TEST(NonFinite, OfAllVoxelsComeBackToo) {
  const SparseVolume source = test::volumeOf({}, 2, 0.0f, [](Coord) { return kNan; });
  for (const Goal& goal :
       {Goal{PresetGoal{}}, Goal{LosslessGoal{}}, Goal{BoundGoal{0.1}}, Goal{PsnrGoal{40.0}}}) {
    ConvertOptions options;
    options.goal = goal;
    const StoredGrid grid = convertVolume({{}, source}, options).grid;
    EXPECT_EQ(equalNonFinite(source, decodeGrid(grid)), 8 * kBrickVoxels);
    EXPECT_LT(bytesAdded(grid), 600u);
    const VolumeMetrics m = compareVolumes(source, decodeGrid(grid));
    EXPECT_EQ(m.psnrActive, std::numeric_limits<double>::infinity());
    EXPECT_EQ(m.maxError, 0.0);
  }
}

TEST(NonFinite, LeaveVolumesWithoutThemAsTheyWere) {
  const SparseVolume source = ballWith([](Coord, float value) { return value; });
  ConvertOptions options;
  options.goal = BoundGoal{0.01};
  const StoredGrid grid = convertVolume({{}, source}, options).grid;
  EXPECT_FALSE(grid.nonFiniteVoxels);
  EXPECT_EQ(grid.nonFinite.total(), 0u);
  EsvrFile file;
  file.grids.push_back(grid);
  constexpr std::size_t kVersionMinorAt = 10;
  EXPECT_LE(std::to_integer<int>(encodeEsvr(file)[kVersionMinorAt]), 5);
}

TEST(NonFinite, AreThereInABoxOnlyWhereItContainsThem) {
  const SparseVolume source = damagedBall();
  ConvertOptions options;
  options.goal = BoundGoal{0.01};
  const StoredGrid grid = convertVolume({{}, source}, options).grid;
  const SparseVolume part = decodeGrid(grid, {.box = Box{{20, 12, 4}, {20, 12, 4}}});
  EXPECT_EQ(activeVoxelCount(part), 1u);
  EXPECT_EQ(valueAt(part, {20, 12, 4}), kInf);
}

TEST(NonFinite, ASizeThatTheirPlacesExceedIsRefused) {
  ConvertOptions options;
  options.goal = SizeGoal{60};
  const SparseVolume source = damagedBall();
  EXPECT_THAT(
      [&] {
        (void)convertVolume({{}, source}, options);
      },
      ThrowsMessage<UsageError>(HasSubstr("not finite take")));
}

TEST(NonFinite, ThatStayInTheirPlacesAreStoredOnceInASequence) {
  const auto frame = [](float gain, int first) {
    return ballWith([&](Coord v, float value) {
      return (v.x * 5 + v.y * 3 + v.z * 11 + first) % 17 == 0 ? kNan : gain * value;
    });
  };
  ConvertOptions options;
  options.goal = BoundGoal{0.02};
  const auto encoded = [&](const SparseVolume& volume, const EsvrFile* before) {
    ConvertOptions own = options;
    if (before) own.previous = &before->grids.front();
    EsvrFile file;
    file.grids.push_back(convertVolume({{}, volume}, own).grid);
    return encodeFrame(file, before);
  };
  const EsvrFile first = decodeFrame(encoded(frame(1.0f, 0), nullptr), "f", {}, nullptr);
  const SparseVolume still = frame(0.9f, 0), moved = frame(0.9f, 1);
  const auto same = encoded(still, &first), other = encoded(moved, &first);
  ASSERT_TRUE(dependsOnPrevious(same));
  ASSERT_TRUE(dependsOnPrevious(other));
  EXPECT_LT(same.size() + 500, other.size());
  EXPECT_EQ(equalNonFinite(still, decodeGrid(decodeFrame(same, "f", {}, &first).grids.front())),
            equalNonFinite(still, still));
  EXPECT_EQ(equalNonFinite(moved, decodeGrid(decodeFrame(other, "f", {}, &first).grids.front())),
            equalNonFinite(moved, moved));
  EsvrFile without = first;
  without.grids.front().nonFinite = {};
  without.grids.front().nonFiniteVoxels.reset();
  EXPECT_THROW((void)decodeFrame(same, "f", {}, &without), BadInput);
}

// ---- Values that are filled in

TEST(FilledVoxels, AreMeansOfNeighboursFromTheOutsideInward) {
  // A line of voxels 1, NaN, NaN, NaN, 5 along z.
  SparseVolume line = makeVolume({[] {
                                   BrickInput brick{{}, {}, {}};
                                   const float values[] = {1.0f, kNan, kNan, kNan, 5.0f};
                                   for (int z = 0; z < 5; ++z) {
                                     brick.values[std::size_t(z)] = values[z];
                                     brick.active.set(z);
                                   }
                                   return brick;
                                 }()},
                                 0.0f);
  const SparseVolume means = withFilledVoxels(line, ValueType::kFloat, Filling::kMeans);
  for (int z = 1; z < 4; ++z)
    EXPECT_NEAR(valueAt(means, {0, 0, z}), 1.0 + z, 0.01) << "a slope from the 1 to the 5";
  const SparseVolume copies = withFilledVoxels(line, ValueType::kFloat, Filling::kCopies);
  EXPECT_EQ(valueAt(copies, {0, 0, 2}), 1.0f);
}

TEST(FilledVoxels, KeepTheRangeOfTheOthersAndTheActiveVoxels) {
  const SparseVolume source = damagedBall();
  for (const Filling filling : {Filling::kMeans, Filling::kCopies}) {
    const SparseVolume filled = withFilledVoxels(source, ValueType::kFloat, filling);
    EXPECT_FALSE(hasNonFinite(filled));
    EXPECT_EQ(filled.active, source.active);
    EXPECT_EQ(activeRange(filled).min, activeRange(source).min);
    EXPECT_EQ(activeRange(filled).max, activeRange(source).max);
  }
}

// A linear function is the mean of its neighbours everywhere. Twelve rounds leave a part of the first guess that is below
// a hundredth of the range.
TEST(FilledVoxels, ContinueALinearFunctionThroughAWideGap) {
  const auto slope = [](Coord v) {
    return 0.03f * float(v.x) + 0.02f * float(v.y) - 0.01f * float(v.z) + 1.0f;
  };
  const SparseVolume source = test::volumeOf({}, 4, 0.0f, [&](Coord v) {
    return std::hypot(v.x - 15.0, v.y - 16.0, v.z - 14.0) < 12.0 ? kNan : slope(v);
  });
  const SparseVolume filled = withFilledVoxels(source, ValueType::kFloat, Filling::kMeans);
  double largest = 0.0;
  for (int n = 0; n < 32 * 32 * 32; ++n) {
    const Coord v{n / 1024, n / 32 % 32, n % 32};
    largest = std::max(largest, std::abs(double(valueAt(filled, v)) - slope(v)));
  }
  EXPECT_LT(largest, 0.015);
}

/// Turbulent smoke of 32^3 voxels: waves of 5 to 25 voxels in all directions. \param gap  where it has NaN
SparseVolume smokeWith(const std::function<bool(Coord)>& gap) {
  test::Random random(5);
  std::vector<std::array<double, 4>> waves(40);  // along x, y and z, and the phase
  for (auto& wave : waves)
    wave = {random(-0.7, 0.7), random(-0.7, 0.7), random(-0.7, 0.7), random(0.0, 6.3)};
  return test::volumeOf({}, 4, 0.0f, [&](Coord v) {
    if (gap(v)) return kNan;
    double sum = 0.0;
    for (const auto& w : waves) sum += std::sin(w[0] * v.x + w[1] * v.y + w[2] * v.z + w[3]);
    return float(std::max(0.05, 2.0 + 0.25 * sum));
  });
}

/// The quality of a conversion is that of the other voxels, whether it is measured by values or by what is seen. Errors
/// at the others count.
TEST(FilledVoxels, CountInNoQuality) {
  const SparseVolume damagedSource = damagedBall();
  const auto layer = format::nonFiniteLayer(damagedSource);
  ASSERT_TRUE(layer);
  const SparseVolume source = withFilledVoxels(damagedSource, ValueType::kFloat, Filling::kMeans);
  const auto changed = [&](bool atFilled) {
    SparseVolume volume = source;
    for (std::size_t n = 0; n < volume.values.size(); ++n)
      if (std::isfinite(damagedSource.values[n]) != atFilled && source.values[n] > 0.1f)
        volume.values[n] *= 0.9f;
    return volume;
  };
  GridDescriptor descriptor;
  descriptor.gridClass = GridClass::kFogVolume;
  const ConvertInput input{descriptor, source};
  ConvertOptions options;
  options.goal = PictureGoal{40.0};
  options.filled = &*layer;
  const encode::Judge judge(input, options, {});
  ASSERT_TRUE(judge.seesPictures());
  for (const encode::Judge* by : {&judge, static_cast<const encode::Judge*>(nullptr)}) {
    const encode::Job job{input, options, by};
    EXPECT_EQ(psnrOf(job, changed(true)), HUGE_VAL);
    EXPECT_LT(psnrOf(job, changed(false)), 40.0);
  }
}

/// Means without the relaxation have creases in the ball, which take 4 % more bytes than the smoke.
TEST(FilledVoxels, TakeNoMoreBytesThanTheVoxelsThatTheyReplace) {
  ConvertOptions options;
  options.goal = PsnrGoal{27.0};
  options.representation = Representation::kEllipsoids;
  const auto bytes = [&](const std::function<bool(Coord)>& gap) {
    const SparseVolume smoke = smokeWith(gap);
    return bytesAdded(
        convertVolume({{}, withFilledVoxels(smoke, ValueType::kFloat, Filling::kMeans)}, options)
            .grid);
  };
  const std::uint64_t whole = bytes([](Coord) { return false; });
  EXPECT_LE(bytes([](Coord v) { return std::hypot(v.x - 15.0, v.y - 16.0, v.z - 17.0) < 11.0; }),
            whole);
  EXPECT_LE(bytes([](Coord v) { return (v.x * 7 + v.y * 3 + v.z * 11) % 5 == 0; }), whole);
}

TEST(FilledVoxels, WithoutANeighbourHaveTheBackgroundOrTheNearestValue) {
  const auto lonely = [](float background) {
    BrickInput value{{}, {}, {}}, missing{{64, 0, 0}, {}, {}};
    value.values.fill(background), missing.values.fill(background);
    value.values[0] = 280.0f, value.values[1] = 300.0f;
    value.active.set(0), value.active.set(1);
    missing.values[7] = kInf;
    missing.active.set(7);
    return makeVolume({value, missing}, background);
  };
  const auto filled = [&](float background) {
    return valueAt(withFilledVoxels(lonely(background), ValueType::kFloat, Filling::kMeans),
                   {64, 0, 7});
  };
  EXPECT_EQ(filled(290.0f), 290.0f);
  EXPECT_EQ(filled(0.0f), 280.0f);
}

// ---- Comparing

TEST(NonFinite, OfOneVolumeOnlyAreNamed) {
  const SparseVolume a = damagedBall();
  SparseVolume b = a;
  const Coord at{20, 12, 4};
  float& value = b.brickValues(*findBrick(b, brickOf(at - b.origin)))[voxelOffset(localOf(at))];
  const auto compare = [&] { (void)compareVolumes(a, b); };
  value = kNan;
  EXPECT_THAT(compare, ThrowsMessage<BadInput>(HasSubstr(
                           "(20, 12, 4) is not finite: it is infinity in the reference, and NaN")));
  value = -kInf;
  EXPECT_THAT(compare, ThrowsMessage<BadInput>(HasSubstr("minus infinity in the other one")));
  value = 1.0f;
  EXPECT_THAT(compare, ThrowsMessage<BadInput>(HasSubstr("a number in the other one")));
}

TEST(NonFinite, ChangeNoFigureOfTheOthers) {
  const auto noisy = [](Coord v, float value) {
    return value == 0.0f ? value : value + 0.01f * float((v.x * 7 + v.y * 5 + v.z) % 3);
  };
  // The damaged voxels of one pair are empty in the other one.
  const auto pair = [&](bool isDamaged, bool isNoisy) {
    SparseVolume made = ballWith([&](Coord v, float value) {
      const float d = damaged(v, value);
      return std::isfinite(d) && isNoisy ? noisy(v, value) : d;
    });
    if (!isDamaged) dropNonFinite(made);
    return made;
  };
  const Box box{{8, 0, -8}, {31, 23, 15}};
  const CompareOptions options{.box = box, .peak = 1.0, .ssim = true, .transmittance = true};
  const VolumeMetrics with = compareVolumes(pair(true, false), pair(true, true), options);
  const VolumeMetrics without = compareVolumes(pair(false, false), pair(false, true), options);
  EXPECT_GT(with.nonFinite, 0u);
  const double squares = without.mseBox * box.volume();  // added in another order
  EXPECT_NEAR(with.mseBox * (box.volume() - double(with.nonFinite)), squares, 1e-12 * squares);
  EXPECT_NEAR(with.mseActive, without.mseActive, 1e-12 * without.mseActive);
  EXPECT_EQ(with.maxError, without.maxError);
  EXPECT_EQ(with.p999Error, without.p999Error);
  EXPECT_EQ(with.iou, without.iou);
  EXPECT_EQ(with.massReference, without.massReference);
  EXPECT_EQ(with.ssim, without.ssim);
  EXPECT_EQ(with.transmittance->psnr50, without.transmittance->psnr50);
}

}  // namespace
}  // namespace esvr
