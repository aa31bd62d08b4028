// Plan: OpenVDB's types are registered by openvdb::initialize() only. Reading, listing and decoding
// an .esvr file must not register them; writing a VDB must, which shows that the question is right.

#include <gtest/gtest.h>
#include <openvdb/openvdb.h>

#include <vector>

#include "esvr/grid_coding.h"
#include "esvr/vdb_io.h"
#include "support/temporary_folder.h"

namespace esvr {
namespace {

bool isInitialised() { return openvdb::GridBase::isRegistered(openvdb::FloatGrid::gridType()); }

StoredGrid oneSphere() {
  StoredGrid grid;
  Ellipsoids& e = grid.field.chunks.emplace_back().ellipsoids;
  e.resize(1);
  e.rotation[0][0] = e.intensity[0] = 1.0f;
  grid.activeBox = {{-4, -4, -4}, {4, 4, 4}};
  grid.valueMax = 1.0f;
  return grid;
}

TEST(Start, onlyVdbFilesInitialiseOpenVdb) {
  const test::TemporaryFolder folder;
  const auto path = folder / "sphere.esvr";
  writeEsvr(path, {{}, {oneSphere()}});
  (void)inspectEsvr(path);
  (void)checkEsvr(path);
  const SparseVolume volume = decodeGrid(readEsvr(path).grids.front());
  EXPECT_GT(activeVoxelCount(volume), 0u);
  EXPECT_FALSE(isInitialised());
  GridDescriptor descriptor;
  descriptor.transform = uniformTransform(1.0);
  const std::vector<VolumeGrid> grids{{.descriptor = descriptor, .volume = volume}};
  writeGrids(folder / "sphere.vdb", {}, grids);
  EXPECT_TRUE(isInitialised());
}

}  // namespace
}  // namespace esvr
