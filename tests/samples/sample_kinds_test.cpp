// Plan: every kind has grids that can be written, with the right names, classes and metadata.

#include "generators/sample_kinds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "esvr/error.h"

namespace esvr::samples {
namespace {

using testing::HasSubstr;

const GridDescriptor& descriptor(const SampleFile& file, std::size_t i) {
  return file.grids.at(i).descriptor;
}

TEST(SampleKinds, haveNamesOfTheirOwnAndActiveVoxels) {
  std::set<std::string> names;
  for (const SampleKind& kind : sampleKinds()) {
    EXPECT_TRUE(names.insert(kind.name).second);
    const SampleFile file = kind.make({.resolution = 16});
    ASSERT_FALSE(file.grids.empty()) << kind.name;
    for (const VolumeGrid& grid : file.grids) {
      EXPECT_GT(activeVoxelCount(grid.volume), 0u) << kind.name;
      EXPECT_EQ(grid.descriptor.background, double(grid.volume.background)) << kind.name;
      EXPECT_FALSE(grid.descriptor.transform.mapType.empty()) << kind.name;
    }
  }
}

TEST(SampleKind, listsTheNamesForAnUnknownOne) {
  EXPECT_EQ(sampleKind("plume").name, std::string("plume"));
  EXPECT_THAT([] { (void)sampleKind("smoke"); },
              testing::ThrowsMessage<UsageError>(HasSubstr("tree, plume, blobs")));
}

TEST(SampleKinds, areOneSizeInWorldSpaceWhateverTheResolution) {
  for (const int resolution : {16, 64}) {
    const SampleFile file = sampleKind("tree").make({.resolution = resolution});
    EXPECT_DOUBLE_EQ((*descriptor(file, 0).transform.affine)[0] * resolution, kWorldSize);
  }
}

TEST(SampleKinds, levelsetIsALevelSetOfHalfWidthThree) {
  const SampleFile file = sampleKind("levelset").make({.resolution = 32});
  EXPECT_EQ(descriptor(file, 0).gridClass, GridClass::kLevelSet);
  EXPECT_FLOAT_EQ(float(descriptor(file, 0).background), 30.0f / 32.0f);
}

TEST(SampleKinds, twoGridsDifferInEverythingAConverterMayLose) {
  const SampleFile file = sampleKind("two-grids").make({.resolution = 16});
  ASSERT_EQ(file.grids.size(), 2u);
  EXPECT_EQ(descriptor(file, 0).name, "density");
  EXPECT_EQ(descriptor(file, 0).valueType, ValueType::kHalf);
  EXPECT_EQ(descriptor(file, 0).metadata.size(), 2u);
  EXPECT_EQ(descriptor(file, 1).name, "temperature");
  EXPECT_EQ(descriptor(file, 1).background, 0.25);
  EXPECT_NE(descriptor(file, 0).transform, descriptor(file, 1).transform);
  EXPECT_NE((*descriptor(file, 0).transform.affine)[1], 0.0) << "rotated";
  EXPECT_EQ(file.metadata.front().name, "creator");
}

}  // namespace
}  // namespace esvr::samples
