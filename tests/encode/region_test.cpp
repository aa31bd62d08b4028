// Plan: whatever the goal and the representation, no voxel outside the active box of the source is
// active in the decoded grid, and the overlap of the active voxels suffices. This is checked for
// volumes whose boundaries no threshold finds, for all grids of a file of a simulation, and for
// frames that are predicted. Goals are still reached. Insisting on values gives up the overlap.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "encode/volumes.h"
#include "esvr/encode.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"
#include "esvr/vdb_io.h"

namespace esvr {
namespace {

/// A tube in a faint cloud, most voxels of which have less than a thousandth of the largest value.
SparseVolume faintCloud(Coord corner = {-16, 8, 4096}) {
  test::Random random(5);
  return test::volumeOf(corner, 5, 0.0f, [&](Coord v) {
    const Coord p = v - corner;
    const double r = std::hypot(p.y - 20.0 - 8.0 * std::sin(p.x * 0.2), p.z - 18.0);
    if (r < 4.0) return float(std::min(1.0, 4.0 - r));
    return r + random(-0.5, 0.5) < 13.0 ? float(1e-3 * std::exp(-0.1 * r)) : 0.0f;
  });
}

void expectRegion(const SparseVolume& source, const StoredGrid& grid, const std::string& what) {
  const Box box = activeBox(source), own = activeBox(decodeGrid(grid));
  EXPECT_EQ(own, box) << what << ": " << toString(own.min) << " to " << toString(own.max);
}

ConvertOptions regionOptions(const Goal& goal, Representation representation) {
  ConvertOptions options;
  options.goal = goal;
  options.representation = representation;
  options.fit.iterations = 100;
  options.fit.kappa = 2.0f;
  if (std::holds_alternative<FitGoal>(goal)) options.fit.count = 60;
  return options;
}

const GridDescriptor kRegionDescriptor;

TEST(RegionOfConversion, StaysForEveryGoalAndRepresentationSlow) {
  const SparseVolume source = faintCloud();
  for (const auto representation :
       {Representation::kAuto, Representation::kEllipsoids, Representation::kVoxels})
    for (const Goal& goal : {Goal{FitGoal{}}, Goal{PresetGoal{}}, Goal{SizeGoal{6000}},
                             Goal{PsnrGoal{30.0}}, Goal{BoundGoal{0.05}}}) {
      if (representation == Representation::kVoxels && std::holds_alternative<FitGoal>(goal))
        continue;
      if (representation == Representation::kEllipsoids && std::holds_alternative<BoundGoal>(goal))
        continue;
      const ConvertOptions options = regionOptions(goal, representation);
      const StoredGrid grid = convertVolume({kRegionDescriptor, source}, options).grid;
      const std::string what = "goal " + std::to_string(goal.index()) + ", representation " +
                               std::to_string(int(representation));
      expectRegion(source, grid, what);
      if (const auto* size = std::get_if<SizeGoal>(&goal)) {
        EXPECT_LE(bytesAdded(grid), size->bytes) << what;
      }
      if (const auto* psnr = std::get_if<PsnrGoal>(&goal)) {
        EXPECT_GE(compareVolumes(source, decodeGrid(grid)).psnrBox, psnr->psnr) << what;
      }
    }
}

TEST(RegionOfConversion, StaysInASmallSize) {
  const SparseVolume source = faintCloud();
  for (const auto representation : {Representation::kEllipsoids, Representation::kVoxels}) {
    const auto options = regionOptions(SizeGoal{1100}, representation);
    const StoredGrid grid = convertVolume({kRegionDescriptor, source}, options).grid;
    EXPECT_LE(bytesAdded(grid), 1100u);
    EXPECT_EQ(grid.topology, TopologyKind::kThreshold);
    expectRegion(source, grid, "a small size");
  }
}

TEST(RegionOfConversion, StaysFarFromTheOrigin) {
  for (const int far : {10'000'000, -10'000'000}) {
    const SparseVolume source = faintCloud({far, -far, far});
    const auto options = regionOptions(FitGoal{}, Representation::kEllipsoids);
    expectRegion(source, convertVolume({kRegionDescriptor, source}, options).grid,
                 std::to_string(far));
  }
}

// The voxels of the faint cloud are within the error from the background.
TEST(RegionOfConversion, HoldsTheVoxelsOfTheMaskOnlyIfAsked) {
  const SparseVolume source = faintCloud();
  for (const auto representation : {Representation::kEllipsoids, Representation::kVoxels})
    for (const auto activity : {Activity::kByValue, Activity::kExact}) {
      ConvertOptions options = regionOptions(PsnrGoal{30.0}, representation);
      options.storage.activity = activity;
      const StoredGrid grid = convertVolume({kRegionDescriptor, source}, options).grid;
      const double overlap = compareVolumes(source, decodeGrid(grid)).iou;
      if (activity == Activity::kExact)
        EXPECT_EQ(overlap, 1.0);
      else
        EXPECT_LT(overlap, 0.9);
    }
}

TEST(RegionOfConversion, StaysInAFrameThatIsPredicted) {
  const SparseVolume first = faintCloud(), second = faintCloud({-16, 8, 4104});
  ConvertOptions options = regionOptions(PresetGoal{}, Representation::kVoxels);
  const StoredGrid before = convertVolume({kRegionDescriptor, first}, options).grid;
  options.previous = &before;
  expectRegion(second, convertVolume({kRegionDescriptor, second}, options).grid, "second frame");
}

void expectRegionOfFile(const std::string& path, const ConvertOptions& options) {
  for (const GridSummary& listed : inspectVdb(path).grids) {
    if (!listed.isScalar || !listed.skipReason.empty() || listed.activeVoxels == 0) continue;
    const VolumeGrid grid = readGrid(path, listed.uniqueName);
    expectRegion(grid.volume, convertVolume({grid.descriptor, grid.volume}, options).grid,
                 listed.uniqueName);
  }
}

TEST(RegionOfConversion, StaysForAllGridsOfAFileRealFile) {
  if (std::string(ESVR_DATA_DIR).empty())
    GTEST_SKIP() << "needs the real volumes: configure with -DESVR_DATA_DIR=<their folder>";
  const std::string folder = ESVR_DATA_DIR;
  for (const char* name : {"/sequence/gas_0004.vdb", "/fire/fluid_data_0050.vdb"}) {
    ConvertOptions preset;
    preset.goal = PresetGoal{};
    expectRegionOfFile(folder + name, preset);
    expectRegionOfFile(folder + name, regionOptions(FitGoal{}, Representation::kEllipsoids));
  }
}

}  // namespace
}  // namespace esvr
