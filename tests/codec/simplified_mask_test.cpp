// Plan: simplified masks of smooth and of noisy bodies keep their overlap, their box and their
// bricks, whatever the values; they have fewer voxels that differ from a neighbour, which is what
// masks cost. Voxels that differ much from the background keep their state. Masks of one voxel and
// of full bricks stay as they are. The result depends neither on the place of the volume nor on the
// number of threads. The overlap itself is compared with a count voxel by voxel.

#include "esvr/quantised.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../fit/volumes.h"
#include "support/on_threads.h"

namespace esvr {
namespace {

constexpr double kError = 0.01;

/// A ball with a rough boundary. Its values fall from 1 to about `edge`.
SparseVolume roughBall(double roughness, float edge, Coord origin = {-8, 16, 800}) {
  constexpr int kBricks = 5;
  constexpr double kRadius = 16.0, kMiddle = 20.0, kFaint = 1e-4;
  test::Random random(7);
  return test::volumeOf(origin, kBricks, 0.0f, [&](Coord at) {
    const Coord p = at - origin;
    const double d =
        std::sqrt((p.x - kMiddle) * (p.x - kMiddle) + (p.y - kMiddle) * (p.y - kMiddle) +
                  (p.z - kMiddle) * (p.z - kMiddle)) /
        kRadius;
    if (d + random(-roughness, roughness) > 1.0) return 0.0f;
    return edge + (1.0f - edge) * float(std::max(1.0 - d, kFaint));
  });
}

SparseVolume withMasks(SparseVolume volume, std::vector<BrickMask> masks) {
  volume.active = std::move(masks);
  return volume;
}

/// Faces between voxels in different states.
int facesOf(const SparseVolume& volume) {
  const auto active = [&](Coord voxel) {
    const auto b = findBrick(volume, brickOf(voxel - volume.origin));
    return b && volume.active[*b].test(voxelOffset(localOf(voxel)));
  };
  int faces = 0;
  for (std::size_t b = 0; b < volume.brickCount(); ++b)
    for (int v = 0; v < kBrickVoxels; ++v) {
      const Coord at = volume.brickCorner(b) + voxelLocal(v);
      for (const Coord step : {Coord{1, 0, 0}, Coord{0, 1, 0}, Coord{0, 0, 1}})
        faces += active(at) != active(at + step);
    }
  return faces;
}

TEST(MaskOverlap, CountsTheVoxelsOfBothAndOfEither) {
  std::vector<BrickMask> a(2), b(2);
  for (int v = 0; v < 100; ++v) a[0].set(v);
  for (int v = 60; v < 120; ++v) b[0].set(v);
  a[1].set(511);
  const MaskOverlap overlap = overlapOf(a, b);
  EXPECT_EQ(overlap.both, 40u);
  EXPECT_EQ(overlap.either, 121u);
  EXPECT_DOUBLE_EQ(overlap.iou(), 40.0 / 121.0);
  EXPECT_FALSE(overlap.suffices());
  EXPECT_TRUE(overlapOf({}, {}).suffices());
}

TEST(SimplifiedMask, KeepsTheOverlapAndTheBoxAndLosesItsRoughness) {
  for (const double roughness : {0.02, 0.1, 0.3}) {
    const SparseVolume source = roughBall(roughness, 0.0f);
    const SparseVolume simplified = withMasks(source, simplifiedMask(source, kError));
    EXPECT_TRUE(overlapOf(source.active, simplified.active).suffices()) << roughness;
    EXPECT_EQ(activeBox(simplified), activeBox(source)) << roughness;
    EXPECT_LT(facesOf(simplified), facesOf(source)) << roughness;
  }
}

// All voxels have at least half of the largest value, so that none may be given up.
TEST(SimplifiedMask, KeepsVoxelsThatDifferMuchFromTheBackground) {
  const SparseVolume source = roughBall(0.1, 0.5f);
  const auto masks = simplifiedMask(source, kError);
  for (std::size_t b = 0; b < masks.size(); ++b)
    for (int v = 0; v < kBrickVoxels; ++v) EXPECT_GE(masks[b].test(v), source.active[b].test(v));
}

TEST(SimplifiedMask, OfOneVoxelAndOfFullBricksIsTheMaskItself) {
  SparseVolume one = test::volumeOf({}, 1, 0.0f, [](Coord) { return 0.5f; });
  one.active[0] = {};
  one.active[0].set(77);
  EXPECT_EQ(simplifiedMask(one, kError), one.active);
  SparseVolume full = test::volumeOf({}, 3, 0.0f, [](Coord) { return 0.5f; });
  for (BrickMask& mask : full.active) mask.setAll();
  EXPECT_EQ(simplifiedMask(full, kError), full.active);
  EXPECT_TRUE(simplifiedMask(SparseVolume{}, kError).empty());
}

TEST(SimplifiedMask, IsTheSameFarAwayAndOnAnyNumberOfThreads) {
  const SparseVolume source = roughBall(0.1, 0.0f);
  const auto masks = test::onThreads(1, [&] { return simplifiedMask(source, kError); });
  EXPECT_EQ(test::onThreads(3, [&] { return simplifiedMask(source, kError); }), masks);
  for (const int far : {10'000'000, -10'000'000})
    EXPECT_EQ(simplifiedMask(roughBall(0.1, 0.0f, {far, -far, far}), kError), masks);
}

TEST(SimplifiedMask, ChangesFewerVoxelsForASmallerError) {
  const SparseVolume source = roughBall(0.1, 0.0f);
  const auto changed = [&](double error) {
    const MaskOverlap overlap = overlapOf(simplifiedMask(source, error), source.active);
    return overlap.either - overlap.both;
  };
  EXPECT_GT(changed(1e-2), changed(1e-5));
  EXPECT_EQ(changed(1e-9), 0u);
}

// The expected mask is a coarser one of the same body. Where the two differ by faint voxels, the
// expected state takes fewer bits.
TEST(SimplifiedMask, IsMoreLikeAMaskThatIsExpected) {
  const SparseVolume source = roughBall(0.1, 0.0f);
  const auto coarser = simplifiedMask(source, 4.0 * kError);
  const auto likeness = [&](std::span<const BrickMask> expected) {
    const auto masks = simplifiedMask(source, kError, expected);
    EXPECT_TRUE(overlapOf(source.active, masks).suffices());
    return overlapOf(masks, coarser).iou();
  };
  EXPECT_GT(likeness(coarser), likeness({}));
}

TEST(SimplifiedMasks, AskOnceForWhatIsExpected) {
  const SparseVolume source = roughBall(0.1, 0.0f);
  int asked = 0;
  const SimplifiedMasks masks(source, [&] {
    ++asked;
    return source.active;
  });
  EXPECT_EQ(asked, 0);
  (void)masks.forError(0.0156);
  (void)masks.forError(0.03);
  EXPECT_EQ(asked, 1);
}

TEST(SimplifiedMasks, AreMadeOnceForAllErrorsOfAPowerOfTwo) {
  const SparseVolume source = roughBall(0.1, 0.0f);
  const SimplifiedMasks masks(source);
  const auto first = masks.forError(0.0156);
  EXPECT_EQ(masks.forError(0.015).data(), first.data());
  EXPECT_NE(masks.forError(0.03).data(), first.data());
  EXPECT_EQ(std::vector<BrickMask>(first.begin(), first.end()), simplifiedMask(source, 0x1p-6));
  EXPECT_NO_THROW((void)masks.forError(0.0));
}

}  // namespace
}  // namespace esvr
