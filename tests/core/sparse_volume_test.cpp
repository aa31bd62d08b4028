// Plan: volumes are made from bricks in any order and anywhere, searched and measured, and broken ones are found. The
// voxels that hold a box are those of the definition in small cases. Components of vectors get the bricks and the active
// voxels of all of them, with their own backgrounds, also if one has no brick; lengths are those of the vectors voxel by
// voxel.
//
// The regions of the empty space are compared with a flood fill of all places in a box, for shells with one and with two
// hollows, a solid, and a shell with a hole through which the inside reaches infinity. A place beyond the box is outside.
// Volumes at negative coordinates give the same.
//
// Counts, ranges and the comparison of inactive values follow from the values and their voxels alone, whatever the order
// and the tiles. Any change of a value, a voxel or an axis makes values different.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "esvr/error.h"
#include "esvr/grid.h"
#include "esvr/volume.h"
#include "support/files.h"
#include "support/messages.h"

namespace esvr {
namespace {

// Bricks and voxels.

/// A brick at `corner` with one active voxel of value 1. The other voxels hold 9, which functions
/// of active voxels must ignore.
BrickInput brickWith(Coord corner, Coord activeLocal) {
  BrickInput brick{};
  brick.corner = corner;
  brick.values.fill(9.0f);
  brick.values[std::size_t(voxelOffset(activeLocal))] = 1.0f;
  brick.active.set(voxelOffset(activeLocal));
  return brick;
}

BrickInput emptyBrick(Coord corner) {
  BrickInput brick{};
  brick.corner = corner;
  return brick;
}

TEST(VoxelOffset, WalksABrickWithZFastest) {
  int expected = 0;
  for (int x = 0; x < kBrickSide; ++x)
    for (int y = 0; y < kBrickSide; ++y)
      for (int z = 0; z < kBrickSide; ++z, ++expected) {
        EXPECT_EQ(voxelOffset({x, y, z}), expected);
        EXPECT_EQ(voxelLocal(expected), (Coord{x, y, z}));
      }
}

TEST(BrickOf, RoundsDownForNegativeCoordinates) {
  for (int v : {-17, -16, -9, -8, -1, 0, 7, 8, 10'000'000, -10'000'000, Box::kMin, Box::kMax}) {
    const Coord voxel{v, v, v};
    const Coord local = localOf(voxel);
    EXPECT_GE(local.x, 0);
    EXPECT_LT(local.x, kBrickSide);
    EXPECT_EQ(brickOf(voxel) * kBrickSide + local, voxel) << v;
  }
}

TEST(BrickMask, SetsTestsAndCountsEveryBit) {
  BrickMask mask;
  for (int offset = 0; offset < kBrickVoxels; ++offset) {
    EXPECT_FALSE(mask.test(offset));
    mask.set(offset);
    EXPECT_TRUE(mask.test(offset));
    EXPECT_EQ(mask.count(), offset + 1);
  }
  BrickMask all;
  all.setAll();
  EXPECT_EQ(mask, all);
}

TEST(MakeVolume, OfNothingIsTheBackgroundEverywhere) {
  const auto volume = makeVolume({}, 0.5f);
  EXPECT_EQ(volume.brickCount(), 0u);
  EXPECT_EQ(activeVoxelCount(volume), 0u);
  EXPECT_TRUE(activeBox(volume).empty());
  EXPECT_EQ(valueAt(volume, {-3, 0, 1 << 30}), 0.5f);
  EXPECT_THROW((void)activeRange(volume), BadInput);
  checkInvariants(volume);
}

TEST(MakeVolume, SortsBricksAndPutsTheOriginAtTheSmallestCorner) {
  const auto volume =
      makeVolume({brickWith({8, -16, 0}, {1, 2, 3}), brickWith({-8, 0, 24}, {7, 7, 7})}, 0.0f);
  checkInvariants(volume);
  EXPECT_EQ(volume.origin, (Coord{-8, -16, 0}));
  ASSERT_EQ(volume.brickCount(), 2u);
  EXPECT_EQ(volume.brickCorner(0), (Coord{-8, 0, 24}));
  EXPECT_EQ(volume.brickCorner(1), (Coord{8, -16, 0}));
  EXPECT_EQ(valueAt(volume, {9, -14, 3}), 1.0f);
  EXPECT_EQ(valueAt(volume, {-1, 7, 31}), 1.0f);
  EXPECT_EQ(valueAt(volume, {-1, 7, 30}), 9.0f);
  EXPECT_EQ(activeBox(volume), (Box{{-1, -14, 3}, {9, 7, 31}}));
  EXPECT_EQ(activeVoxelCount(volume), 2u);
}

TEST(MakeVolume, DropsBricksWithoutAnActiveVoxelAndTheirPlace) {
  const auto volume = makeVolume({emptyBrick({-800, 0, 0}), brickWith({8, 8, 8}, {})}, 0.25f);
  EXPECT_EQ(volume.brickCount(), 1u);
  EXPECT_EQ(volume.origin, (Coord{8, 8, 8}));
  EXPECT_EQ(valueAt(volume, {-800, 0, 0}), 0.25f);
}

TEST(MakeVolume, DoesNotDependOnTheOrderOfTheBricks) {
  const auto a = brickWith({0, 0, 0}, {1, 0, 0});
  const auto b = brickWith({0, 0, 8}, {0, 1, 0});
  const auto forward = makeVolume({a, b}, 0.0f);
  const auto backward = makeVolume({b, a}, 0.0f);
  EXPECT_EQ(forward.bricks, backward.bricks);
  EXPECT_EQ(forward.values, backward.values);
  EXPECT_EQ(forward.active, backward.active);
}

class FarVolume : public testing::TestWithParam<std::int32_t> {};

TEST_P(FarVolume, DiffersFromTheNearOneOnlyInItsOrigin) {
  const Coord shift = Coord{1, 1, 1} * (GetParam() & ~(kBrickSide - 1));
  const auto near = makeVolume({brickWith({}, {1, 2, 3}), brickWith({16, 0, 8}, {7, 0, 5})}, 0.0f);
  const auto far = makeVolume(
      {brickWith(shift, {1, 2, 3}), brickWith(shift + Coord{16, 0, 8}, {7, 0, 5})}, 0.0f);
  EXPECT_EQ(far.origin, shift);
  EXPECT_EQ(far.bricks, near.bricks);
  EXPECT_EQ(far.values, near.values);
  EXPECT_EQ(activeBox(far), (Box{activeBox(near).min + shift, activeBox(near).max + shift}));
}

INSTANTIATE_TEST_SUITE_P(Shifts, FarVolume,
                         testing::Values(1 << 20, 10'000'000, -10'000'000, Box::kMin,
                                         Box::kMax - 64));

TEST(MakeVolume, RefusesTwoBricksOfOneCorner) {
  EXPECT_THAT(
      [] {
        (void)makeVolume({brickWith({8, 0, 0}, {}), brickWith({8, 0, 0}, {})}, 0.0f);
      },
      test::ThrowsSaying<BadInput>("(8, 0, 0)"));
}

TEST(MakeVolume, RefusesBricksFurtherApartThanAVolumeAllows) {
  const Coord low{-(1 << 30), 0, 0};
  const auto apart = [&](std::int32_t x) {
    return makeVolume({brickWith(low, {}), brickWith({x, 0, 0}, {})}, 0.0f);
  };
  EXPECT_THAT([&] { (void)apart(1 << 30); }, test::ThrowsSaying<BadInput>("2^31"));
  const auto widest = apart((1 << 30) - 16);
  checkInvariants(widest);
  EXPECT_EQ(valueAt(widest, {(1 << 30) - 16, 0, 0}), 1.0f);
}

TEST(ValueAt, ReachesFromOneEndOfIndexSpaceToTheOther) {
  const Coord low = Coord{1, 1, 1} * Box::kMin;
  const auto volume = makeVolume({brickWith(low, {0, 0, 0})}, 0.5f);
  EXPECT_EQ(valueAt(volume, low), 1.0f);
  EXPECT_EQ(valueAt(volume, Coord{1, 1, 1} * Box::kMax), 0.5f);
}

TEST(ActiveRange, SeesActiveVoxelsOnly) {
  auto brick = brickWith({}, {0, 0, 0});
  brick.values[1] = -2.0f;
  brick.active.set(1);
  const auto range = activeRange(makeVolume({brick}, -100.0f));
  EXPECT_EQ(range.min, -2.0f);
  EXPECT_EQ(range.max, 1.0f);
}

TEST(ActiveRange, LeavesOutWhatIsNotFinite) {
  BrickInput brick = brickWith({}, {0, 0, 0});
  brick.active.setAll();
  for (int v = 0; v < kBrickVoxels; ++v) brick.values[std::size_t(v)] = float(v);
  const float infinity = std::numeric_limits<float>::infinity();
  brick.values[0] = std::numeric_limits<float>::quiet_NaN();
  brick.values[70] = -infinity, brick.values[511] = infinity;
  for (const std::uint64_t word :
       {~0ull, ~1ull}) {  // the words of the mask, and one that is not all ones
    brick.active.words[4] = word;
    const auto range = activeRange(makeVolume({brick}, 0.0f));
    EXPECT_EQ(range.min, 1.0f);
    EXPECT_EQ(range.max, 510.0f);
  }
}

TEST(FindBrick, FindsEveryBrickAndNoOther) {
  const auto volume = makeVolume(
      {brickWith({0, 0, 0}, {}), brickWith({0, 0, 16}, {}), brickWith({8, 0, 0}, {})}, 0.0f);
  for (std::size_t b = 0; b < volume.brickCount(); ++b)
    EXPECT_EQ(findBrick(volume, volume.bricks[b]), b);
  EXPECT_FALSE(findBrick(volume, {0, 0, 1}));
  EXPECT_FALSE(findBrick(volume, {-1, 0, 0}));
  EXPECT_FALSE(findBrick(volume, {2, 0, 0}));
}

TEST(BrickWith, IsThatOfAVoxelAnywhereInIndexSpace) {
  const Coord low{Box::kMin, Box::kMin, Box::kMin};
  const SparseVolume volume =
      makeVolume({brickWith(low, {}), brickWith(low + Coord{8, 0, 0}, {})}, 0.0f);
  EXPECT_EQ(brickWith(volume, low + Coord{15, 7, 7}), std::size_t{1});
  EXPECT_FALSE(brickWith(volume, low + Coord{16, 0, 0}));
  // The difference of these voxels does not fit into 32 bits.
  EXPECT_FALSE(brickWith(volume, Coord{Box::kMax, Box::kMax, Box::kMax}));
}

TEST(WithBricks, HasTheValuesOfTheOtherVolumeAndItsBackground) {
  const SparseVolume volume = makeVolume({brickWith({8, 0, 0}, {})}, 0.25f);
  const std::vector<Coord> corners{{0, 0, 0}, {8, 0, 0}};
  const SparseVolume wide = withBricks(volume, corners);
  checkInvariants(wide);
  EXPECT_EQ(brickCorners(wide), corners);
  EXPECT_EQ(activeVoxelCount(wide), 0u);
  EXPECT_THAT(wide.brickValues(0), testing::Each(0.25f));
  EXPECT_TRUE(std::ranges::equal(wide.brickValues(1), volume.brickValues(0)));
}

struct PeakCase {
  const char* what;
  ValueRange active;
  double background, peak;
  bool isFar;
};

class Peak : public testing::TestWithParam<PeakCase> {};

TEST_P(Peak, IsTheRangeOfOneSignAndTheMagnitudeOfTwo) {
  const PeakCase& c = GetParam();
  EXPECT_DOUBLE_EQ(peakOf(c.active, c.background), c.peak) << c.what;
  EXPECT_EQ(spanOf(c.active, c.background).farBackground, c.isFar) << c.what;
}

INSTANTIATE_TEST_SUITE_P(
    All, Peak,
    testing::Values(
        PeakCase{"a density", {0.0f, 5.5f}, 0.0, 5.5, false},
        PeakCase{"a scan from a threshold on", {0.125f, 1.0f}, 0.0, 1.0, false},
        PeakCase{"a background as far as the values are long", {1.0f, 2.0f}, 0.0, 2.0, false},
        PeakCase{"a background that is farther", {1.5f, 2.0f}, 0.0, 0.5, true},
        PeakCase{"a pressure", {101325.0f, 101365.0f}, 0.0, 40.0, true},
        PeakCase{"kelvin", {280.0f, 310.0f}, 0.0, 30.0, true},
        PeakCase{"kelvin over an ambient background", {280.0f, 310.0f}, 293.0, 30.0, false},
        PeakCase{"no data", {-2.0f, 3.0f}, -9999.0, 3.0, true},
        PeakCase{"a signed distance", {-3.0f, 3.0f}, 3.0, 3.0, false},
        PeakCase{"a band inside its background", {-0.125f, 0.25f}, 0.5, 0.25, false},
        PeakCase{"distances below the background", {0.0f, 2.5f}, 3.0, 2.5, false},
        PeakCase{"from 0 up, over -1", {0.0f, 1.0f}, -1.0, 1.0, false},
        PeakCase{"a velocity", {-8.0f, 2.0f}, 0.0, 8.0, false},
        PeakCase{"only negative", {-3.0f, -1.0f}, 0.0, 3.0, false},
        PeakCase{"negative and offset", {-103.0f, -100.0f}, 0.0, 3.0, true},
        PeakCase{"constant", {-7.0f, -7.0f}, 0.0, 7.0, false},
        PeakCase{"constant beside its background", {7.0f, 7.0f}, 6.0, 7.0, false},
        PeakCase{"zeros", {0.0f, 0.0f}, 0.0, 1.0, false},
        PeakCase{
            "constant but for roundings", {293.15f, 293.15006f}, 0.0, double(293.15006f), false},
        PeakCase{"a negative one", {-1.0f, -0.9999999f}, 0.0, 1.0, false},
        PeakCase{"a step of eight roundings", {1.0f, 1.0000010f}, 0.0, 0x1p-20, true},
        PeakCase{"extreme", {-3e38f, 3e38f}, 0.0, double(3e38f), false}));

TEST(SetBackground, ChangesInactiveVoxelsOnly) {
  SparseVolume volume = makeVolume({brickWith({0, 0, 0}, {1, 2, 3})}, 9.0f);
  setBackground(4.0f, volume);
  EXPECT_EQ(volume.background, 4.0f);
  EXPECT_EQ(valueAt(volume, {1, 2, 3}), 1.0f);
  EXPECT_EQ(valueAt(volume, {1, 2, 4}), 4.0f);
  EXPECT_EQ(valueAt(volume, {8, 0, 0}), 4.0f);
}

class BrokenVolume : public testing::Test {
 protected:
  SparseVolume volume = makeVolume({brickWith({0, 0, 0}, {}), brickWith({0, 0, 8}, {})}, 0.0f);
  void expectRefused() { EXPECT_THROW(checkInvariants(volume), std::logic_error); }
};

TEST_F(BrokenVolume, MissingValuesAreFound) {
  volume.values.pop_back();
  expectRefused();
}
TEST_F(BrokenVolume, MissingMasksAreFound) {
  volume.active.pop_back();
  expectRefused();
}
TEST_F(BrokenVolume, BricksOutOfOrderAreFound) {
  std::swap(volume.bricks[0], volume.bricks[1]);
  expectRefused();
}
TEST_F(BrokenVolume, TheSameBrickTwiceIsFound) {
  volume.bricks[1] = volume.bricks[0];
  expectRefused();
}
TEST_F(BrokenVolume, AnOriginInsideABrickIsFound) {
  volume.origin.y = 4;
  expectRefused();
}

// Vectors.

/// Voxels on the faces of the box (0, 0, 0) to (15, 15, 7), with these values.
SparseVolume onFaces(const std::vector<std::pair<Coord, float>>& voxels) {
  std::vector<BrickInput> bricks(4);
  for (std::size_t b = 0; b < bricks.size(); ++b) {
    bricks[b].corner = Coord{std::int32_t(b / 2), std::int32_t(b % 2), 0} * kBrickSide;
    bricks[b].values.fill(1.0f);
    for (const auto& [at, value] : voxels)
      if (at - localOf(at) == bricks[b].corner) {
        bricks[b].values[std::size_t(voxelOffset(localOf(at)))] = value;
        bricks[b].active.set(voxelOffset(localOf(at)));
      }
  }
  return makeVolume(bricks, 1.0f);
}

TEST(BoxVoxels, AreFewAndTouchAllFaces) {
  // Two corners touch all faces; the others touch one each and differ more from the background.
  const SparseVolume corners = onFaces({{{0, 0, 0}, 1.0f},
                                        {{15, 15, 7}, 2.0f},
                                        {{0, 3, 3}, 9.0f},
                                        {{15, 3, 3}, 9.0f},
                                        {{7, 7, 3}, 9.0f}});
  EXPECT_THAT(boxVoxels(corners, activeBox(corners)),
              testing::ElementsAre(Coord{0, 0, 0}, Coord{15, 15, 7}));
  // Of voxels that touch the same face, the one that differs most from the background is taken.
  const SparseVolume sides = onFaces({{{0, 3, 3}, 1.5f},
                                      {{0, 4, 4}, -3.0f},
                                      {{15, 3, 3}, 2.0f},
                                      {{4, 0, 3}, 2.0f},
                                      {{4, 15, 3}, 2.0f},
                                      {{4, 4, 0}, 2.0f},
                                      {{4, 5, 0}, 1.0f},
                                      {{4, 4, 7}, 2.0f}});
  EXPECT_THAT(boxVoxels(sides, activeBox(sides)),
              testing::ElementsAre(Coord{0, 4, 4}, Coord{4, 0, 3}, Coord{4, 4, 0}, Coord{4, 4, 7},
                                   Coord{4, 15, 3}, Coord{15, 3, 3}));
  EXPECT_THAT(boxVoxels(sides, activeBox(sides), 1u | 32u),
              testing::ElementsAre(Coord{0, 4, 4}, Coord{4, 4, 7}));
}

TEST(BoxVoxels, OfOneVoxelAreThatVoxelAndOfNoneNothing) {
  const SparseVolume one = makeVolume({brickWith({-16, 8, 1 << 30}, {3, 0, 7})}, 1.0f);
  EXPECT_THAT(boxVoxels(one, activeBox(one)), testing::ElementsAre(activeBox(one).min));
  EXPECT_EQ(touchedFaces(one, activeBox(one), one.active), kAllFaces);
  EXPECT_TRUE(boxVoxels(SparseVolume{}, Box{}).empty());
}

TEST(BoxVoxels, FacesOfMasksAreThoseOfTheirVoxels) {
  const SparseVolume volume =
      onFaces({{{0, 3, 3}, 2.0f}, {{15, 15, 3}, 2.0f}, {{4, 0, 7}, 2.0f}, {{4, 4, 0}, 2.0f}});
  const Box box = activeBox(volume);
  EXPECT_EQ(touchedFaces(volume, box, volume.active), kAllFaces);
  std::vector<BrickMask> masks(volume.brickCount());
  EXPECT_EQ(touchedFaces(volume, box, masks), 0u);
  masks.back() = volume.active.back();  // that of (15, 15, 3)
  EXPECT_EQ(touchedFaces(volume, box, masks), 2u | 8u);
}

/// A volume with one active voxel.
SparseVolume voxel(Coord at, float value, float background) {
  BrickInput brick{brickOf(at) * kBrickSide, {}, {}};
  brick.values.fill(background);
  brick.values[std::size_t(voxelOffset(localOf(at)))] = value;
  brick.active.set(voxelOffset(localOf(at)));
  return makeVolume({brick}, background);
}

constexpr Coord kLow{-3, 1, 2}, kHigh{20, 1, 2};

VectorVolume apart() {
  SparseVolume none;
  none.background = 2.0f;
  return {voxel(kLow, 3.0f, 0.0f), voxel(kHigh, 4.0f, -1.0f), none};
}

TEST(Vectors, AreAlignedToTheBricksAndActiveVoxelsOfAllComponents) {
  const VectorVolume vectors = aligned(apart());
  for (const SparseVolume& volume : vectors) {
    checkInvariants(volume);
    EXPECT_EQ(volume.origin, (Coord{-8, 0, 0}));
    EXPECT_EQ(volume.bricks, vectors[0].bricks);
    EXPECT_EQ(activeVoxelCount(volume), 2u);
  }
  EXPECT_EQ(valueAt(vectors[0], kLow), 3.0f);
  EXPECT_EQ(valueAt(vectors[0], kHigh), 0.0f);
  EXPECT_EQ(valueAt(vectors[1], kLow), -1.0f);
  EXPECT_EQ(valueAt(vectors[2], kHigh), 2.0f);
}

TEST(Vectors, HaveLengths) {
  const SparseVolume lengths = magnitudeOf(apart());
  EXPECT_FLOAT_EQ(valueAt(lengths, kLow), std::sqrt(9.0f + 1.0f + 4.0f));
  EXPECT_FLOAT_EQ(valueAt(lengths, kHigh), std::sqrt(16.0f + 4.0f));
  EXPECT_FLOAT_EQ(lengths.background, std::sqrt(1.0f + 4.0f));
}

TEST(Vectors, WhoseSquaresExceedFloatHaveLengths) {
  const VectorVolume vectors{voxel(kLow, 3e30f, 0.0f), voxel(kLow, 4e30f, 0.0f), SparseVolume{}};
  EXPECT_FLOAT_EQ(valueAt(magnitudeOf(vectors), kLow), 5e30f);
}

TEST(Vectors, WithoutVoxelsHaveNone) { EXPECT_EQ(magnitudeOf({}).brickCount(), 0u); }

TEST(Vectors, NameTheirComponents) { EXPECT_EQ(componentName("v[1]", 2), "v[1].z"); }

// Signs of the empty space.

constexpr int kSide = 8;  // bricks along an edge of the box

/// True if a voxel of a brick touches a place that is inside through a face of the brick.
bool touchesInside(Coord brick, Coord local, const std::function<bool(Coord)>& isInside) {
  const auto step = [](int at) { return at == 0 ? -1 : at == kBrickSide - 1 ? 1 : 0; };
  const Coord s{step(local.x), step(local.y), step(local.z)};
  return isInside(brick + Coord{s.x, 0, 0}) || isInside(brick + Coord{0, s.y, 0}) ||
         isInside(brick + Coord{0, 0, s.z});
}

/// A volume with bricks where `has` says so. Their slices have the sign of the places beside them.
SparseVolume bricksWhere(Coord shift, const std::function<bool(Coord)>& has,
                         const std::function<bool(Coord)>& isInside) {
  std::vector<BrickInput> bricks;
  for (int x = 0; x < kSide; ++x)
    for (int y = 0; y < kSide; ++y)
      for (int z = 0; z < kSide; ++z) {
        if (!has({x, y, z})) continue;
        BrickInput brick{(Coord{x, y, z} + shift) * kBrickSide, {}, {}};
        brick.active.setAll();
        for (int v = 0; v < kBrickVoxels; ++v)
          brick.values[std::size_t(v)] =
              touchesInside({x, y, z}, voxelLocal(v), isInside) ? -1.0f : 0.0f;
        bricks.push_back(brick);
      }
  return makeVolume(std::move(bricks), 3.0f);
}

bool within(Coord p, int low, int high) {
  return std::min({p.x, p.y, p.z}) >= low && std::max({p.x, p.y, p.z}) <= high;
}

TEST(EmptySigns, AreThoseInsideAndOutsideOfShells) {
  const auto hollow = [](Coord p) { return within(p, 3, 4); };
  for (const Coord shift : {Coord{0, 0, 0}, Coord{-20, -3, 7}}) {
    const SparseVolume shell = bricksWhere(
        shift, [&](Coord p) { return within(p, 2, 5) && !hollow(p); }, hollow);
    const EmptySigns signs(shell);
    EXPECT_TRUE(signs.agree());
    for (int x = -1; x <= kSide; ++x)
      for (int y = -1; y <= kSide; ++y)
        for (int z = -1; z <= kSide; ++z)
          if (const Coord p{x, y, z}; !within(p, 2, 5) || hollow(p)) {
            ASSERT_EQ(signs.isInside(p + shift), hollow(p)) << x << ' ' << y << ' ' << z;
          }
  }
}

TEST(EmptySigns, OfTwoHollowsAreTheirOwn) {
  const auto inside = [](Coord p) { return within(p, 1, 2); };
  const auto cavity = [](Coord p) { return within(p, 5, 6); };  // outside, though enclosed
  const EmptySigns signs(bricksWhere(
      {}, [&](Coord p) { return within(p, 0, 7) && !inside(p) && !cavity(p); }, inside));
  EXPECT_TRUE(signs.agree());
  EXPECT_TRUE(signs.isInside({1, 2, 1}));
  EXPECT_FALSE(signs.isInside({5, 6, 5}));
  EXPECT_FALSE(signs.isInside({100, 2, 1}));
}

TEST(EmptySigns, DisagreeAroundAHole) {
  const auto hollow = [](Coord p) { return within(p, 3, 4); };
  const auto shell = [&](Coord p) { return within(p, 2, 5) && !hollow(p); };
  EXPECT_TRUE(EmptySigns(bricksWhere({}, shell, hollow)).agree());
  for (const Coord hole : {Coord{2, 3, 3}, Coord{3, 5, 4}, Coord{4, 3, 5}})
    EXPECT_FALSE(EmptySigns(bricksWhere(
                                {}, [&](Coord p) { return shell(p) && p != hole; }, hollow))
                     .agree());
}

TEST(EmptySigns, WithoutAHollowAreOutside) {
  const auto solid = [](Coord p) { return within(p, 2, 4); };
  const EmptySigns signs(bricksWhere({}, solid, [](Coord) { return false; }));
  EXPECT_TRUE(signs.agree());
  EXPECT_FALSE(signs.isInside({0, 0, 0}));
  EXPECT_FALSE(EmptySigns(bricksWhere({}, solid, [](Coord) { return true; })).agree());
}

// Inactive values.

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

InactiveValues one(double value, Coord voxel) {
  InactiveValues values;
  values.add(value, voxel);
  return values;
}

TEST(InactiveValues, OfATileAreThoseOfItsVoxels) {
  const Box tile{{-4, 8, 100}, {3, 15, 107}};
  InactiveValues whole, voxels;
  whole.add(2.5, tile);
  for (int x = tile.max.x; x >= tile.min.x; --x)
    for (int y = tile.min.y; y <= tile.max.y; ++y)
      for (int z = tile.min.z; z <= tile.max.z; ++z) voxels.add(2.5, Coord{x, y, z});
  EXPECT_EQ(whole, voxels);
  EXPECT_EQ(whole.count(), 512u);
}

TEST(InactiveValues, DifferByValueVoxelAndAxis) {
  const InactiveValues values = one(1.0, {1, 2, 3});
  EXPECT_EQ(values, one(1.0, {1, 2, 3}));
  EXPECT_FALSE(values == one(1.5, {1, 2, 3}));
  EXPECT_FALSE(values == one(-1.0, {1, 2, 3}));
  EXPECT_FALSE(values == one(1.0, {3, 2, 1}));
  EXPECT_FALSE(values == one(1.0, {1, 2, 4}));
  EXPECT_FALSE(values == InactiveValues());
  EXPECT_EQ(one(kNan, {}), one(kNan, {}));
  EXPECT_EQ(one(0.0, {}), one(-0.0, {})) << "equal values";
}

TEST(InactiveValues, DifferByComponent) {
  InactiveValues x, y;
  x.add(one(1.0, {}).ofComponent(0));
  y.add(one(1.0, {}).ofComponent(1));
  EXPECT_FALSE(x == y);
}

TEST(InactiveValues, HaveARangeOfTheFiniteOnes) {
  InactiveValues values = one(kNan, {7, 8, 9});
  EXPECT_EQ(values.nonFinite(), 1u);
  values.add(-3.0, Coord{0, 0, 1});
  values.add(one(-2.0, {0, 0, 2}));
  EXPECT_EQ(values.min(), -3.0);
  EXPECT_EQ(values.max(), -2.0);
  EXPECT_EQ(toText(values),
            "3 inactive values (-3 to -2, and 1 NaN or infinite, first at (7, 8, 9))");
  EXPECT_EQ(toText(one(5.0, {1, 2, 3})), "1 inactive value (5, first at (1, 2, 3))");
}

TEST(InactiveValues, OfTheLargestTileAreCounted) {
  InactiveValues values;
  values.add(1.0, Box{{0, 0, 0}, {4095, 4095, 4095}});
  EXPECT_EQ(values.count(), std::uint64_t{1} << 36);
}

// ---- Memory

constexpr std::size_t kMega = std::size_t{1} << 20;

/// Arrays of more than 1 KB are in files, and as little as possible of them is in memory.
VoxelMemory filesIn(const std::filesystem::path& folder) {
  return VoxelMemory({.folder = folder, .maxHeapBytes = 1024, .maxResidentBytes = 0});
}

std::uint64_t residentFileBytes() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;)
    if (std::uint64_t kilobytes = 0; word == "RssFile:" && status >> kilobytes)
      return kilobytes * 1024;
  return 0;
}

TEST(VoxelMemory, IsTheHeapByDefault) {
  EXPECT_FALSE(VoxelMemory().isInFile(std::uint64_t{1} << 60));
  const VoxelArray<float> array(100, 2.0f);
  EXPECT_EQ(array.back(), 2.0f);
}

TEST(VoxelMemory, IsAFileAboveTheLimitOnly) {
  const test::TemporaryFolder folder;
  const VoxelMemory memory = filesIn(folder.path());
  EXPECT_FALSE(memory.isInFile(1024));
  EXPECT_TRUE(memory.isInFile(1025));
  EXPECT_TRUE(memory.forAllSizes().isInFile(1));
  EXPECT_FALSE(VoxelMemory().forAllSizes().isInFile(1));
}

TEST(VoxelMemory, OfAFileHoldsWhatIsWrittenAndGrows) {
  const test::TemporaryFolder folder;
  VoxelArray<int> array(filesIn(folder.path()));
  for (int i = 0; i < 100'000; ++i) array.push_back(i);
  std::vector<int> expected(array.size());
  std::iota(expected.begin(), expected.end(), 0);
  EXPECT_TRUE(std::equal(array.begin(), array.end(), expected.begin(), expected.end()));
  EXPECT_TRUE(folder.names().empty()) << "the files have no names";
}

TEST(VoxelMemory, OfACopyIsThatOfTheOriginal) {
  const test::TemporaryFolder folder;
  const VoxelArray<float> original(5000, 1.0f, filesIn(folder.path()));
  VoxelArray<float> copy = original, assigned;
  assigned = original;
  copy[7] = 2.0f;
  EXPECT_EQ(original[7], 1.0f);
  EXPECT_EQ(assigned, original);
  for (const auto& array : {copy, assigned})
    EXPECT_EQ(array.get_allocator().memory(), original.get_allocator().memory());
}

// The array keeps its content while a thread gives back its memory again and again.
TEST(VoxelMemory, GivesBackWhatExceedsTheLimit) {
  const test::TemporaryFolder folder;
  const std::uint64_t before = residentFileBytes();
  VoxelArray<std::uint64_t> array(64 * kMega / sizeof(std::uint64_t), filesIn(folder.path()));
  std::iota(array.begin(), array.end(), std::uint64_t{0});
  const auto isGivenBack = [&] { return residentFileBytes() < before + 8 * kMega; };
  for (int tries = 0; tries < 1000 && !isGivenBack(); ++tries)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_TRUE(isGivenBack());
  for (std::size_t i = 0; i < array.size(); ++i) ASSERT_EQ(array[i], i);
}

TEST(VoxelMemory, RefusesAFolderThatIsNotThere) {
  const test::TemporaryFolder folder;
  const VoxelMemory memory = filesIn(folder / "missing");
  try {
    const VoxelArray<float> array(1000, memory);
    FAIL() << "no error";
  } catch (const RuntimeFailure& error) {
    EXPECT_NE(std::string(error.what()).find((folder / "missing").string()), std::string::npos);
  }
}

// A write to a file without room would end the process with SIGBUS.
TEST(VoxelMemory, RefusesAFullDiskBeforeAnythingIsWritten) {
  const test::TemporaryFolder folder;
  const VoxelMemory memory = filesIn(folder.path());
  const std::size_t beyondAnyDisk = std::size_t{1} << 58;
  EXPECT_THROW((void)memory.allocate(beyondAnyDisk), RuntimeFailure);
}

}  // namespace

}  // namespace esvr
