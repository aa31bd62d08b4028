// Plan: the octree search agrees with a plain visit of every voxel, for every kind of shape, and
// keeps its limits.

#include "generators/voxelise.h"

#include <gtest/gtest.h>

#include "generators/shapes.h"
#include "generators/tubes.h"

namespace esvr::samples {
namespace {

template <class S>
void expectSameAsPlainVisit(const S& shape, const SparseVolume& volume, const Box& box) {
  std::uint64_t active = 0;
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z) {
        const Sample sample = shape.at({double(x), double(y), double(z)});
        if (!sample.active) continue;
        ++active;
        ASSERT_EQ(valueAt(volume, {x, y, z}), sample.value) << toString(Coord{x, y, z});
      }
  EXPECT_EQ(activeVoxelCount(volume), active);
  EXPECT_NO_THROW(checkInvariants(volume));
}

template <class S>
void searchAndCompare(const S& shape, const Box& box, float background = 0.0f) {
  const SparseVolume volume = voxelise(shape, {.box = box, .background = background});
  expectSameAsPlainVisit(shape, volume, box);
}

TEST(Voxelise, findsEveryVoxelOfTubes) {
  auto tubes = treeTubes({.resolution = 200, .seed = 2});
  tubes.resize(40);  // the plain visit tests every tube at every voxel
  searchAndCompare(TubeShape(tubes, 2.0), boundsOf(tubes, 2.0));
}

TEST(Voxelise, findsEveryVoxelOfAPlume) {
  for (const int resolution : {9, 64})
    searchAndCompare(PlumeShape(3, resolution),
                     Box{{0, 0, 0}, {resolution - 1, resolution - 1, resolution - 1}});
}

TEST(Voxelise, findsEveryVoxelOfBlobsAtNegativeCoordinates) {
  const std::vector<Blob> blobs{{{-20.0, 3.0, -7.5}, 9.0, 1.0}, {{5.0, 6.0, 7.0}, 4.0, 0.5}};
  searchAndCompare(BlobShape(blobs, 0.25f), Box{{-30, -7, -17}, {10, 13, 12}}, 0.25f);
}

TEST(Voxelise, findsEveryVoxelOfALevelSet) {
  searchAndCompare(LevelSetShape(40, 0.1), Box{{-4, -4, -4}, {44, 44, 44}}, 0.3f);
}

TEST(Voxelise, ofAnEmptyShapeHasNoBrick) {
  const std::vector<Blob> blobs{{{500.0, 0.0, 0.0}, 4.0, 1.0}};
  const auto volume =
      voxelise(BlobShape(blobs, 0.5f), {.box = {{0, 0, 0}, {9, 9, 9}}, .background = 0.5f});
  EXPECT_EQ(volume.brickCount(), 0u);
  EXPECT_EQ(volume.background, 0.5f);
}

TEST(Voxelise, givesUpBeyondTheBricksAllowed) {
  EXPECT_THROW((void)makeBlobs({.resolution = 64, .limits = {.maxBricks = 10}}), DeviceError);
}

TEST(Voxelise, stopsWhenCancelled) {
  CancelToken token;
  token.cancel();
  EXPECT_THROW((void)makeBlobs({.resolution = 64, .limits = {.cancel = &token}}), Cancelled);
}

}  // namespace
}  // namespace esvr::samples
