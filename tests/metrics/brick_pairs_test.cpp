// Plan: the selection by digits agrees with sorting for errors of all magnitudes, and ranks with
// counting.

#include "metrics/brick_pairs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "esvr/metrics.h"
#include "metrics/volumes.h"

namespace esvr::metrics {
namespace {

/// A row of voxels whose errors against an empty candidate are given.
SparseVolume rowOf(const std::vector<float>& errors) {
  std::vector<test::Voxel> voxels;
  for (std::size_t i = 0; i < errors.size(); ++i)
    voxels.push_back({{int(i) * 3 - 40, 1, -1}, errors[i]});
  return test::volumeOf(voxels);
}

TEST(ErrorOfRank, isTheSortedErrorOfThatRank) {
  std::vector<float> errors;
  for (std::uint64_t i = 0; i < 200; ++i) {
    const double magnitude = std::pow(10.0, 60.0 * test::hashUnit(1, i) - 30.0);
    errors.push_back(float(i % 2 ? magnitude : -magnitude));
  }
  errors.insert(errors.end(), {0.0f, 0.0f, 1.0f, 1.0f, -1.0f});
  const SparseVolume reference = rowOf(errors), none;
  const auto pairs = pairBricks(reference, none);
  for (float& e : errors) e = std::abs(e);
  std::sort(errors.begin(), errors.end());
  for (std::size_t rank = 1; rank <= errors.size(); rank += rank < 8 ? 1 : 13)
    ASSERT_EQ(errorOfRank(pairs, rank), errors[rank - 1]) << "rank " << rank;
}

TEST(ErrorOfRank, countsEachVoxelOfTheUnionOnce) {
  const auto a = test::volumeOf({{{0, 0, 0}, 1.0f}, {{1, 0, 0}, 2.0f}});
  const auto b = test::volumeOf({{{1, 0, 0}, 5.0f}, {{9, 0, 0}, 7.0f}});
  const auto pairs = pairBricks(a, b);
  EXPECT_EQ(errorOfRank(pairs, 1), 1.0);
  EXPECT_EQ(errorOfRank(pairs, 2), 3.0);
  EXPECT_EQ(errorOfRank(pairs, 3), 7.0);
}

TEST(NearestRank, isTheCeilingOfTheShare) {
  EXPECT_EQ(nearestRank(1, 999), 1u);
  EXPECT_EQ(nearestRank(999, 999), 999u);  // the ceiling of 998.001
  EXPECT_EQ(nearestRank(1000, 999), 999u);
  EXPECT_EQ(nearestRank(1001, 999), 1000u);
  EXPECT_EQ(nearestRank(2000, 999), 1998u);
  EXPECT_EQ(nearestRank(std::uint64_t{1} << 60, 1000), std::uint64_t{1} << 60);
}

TEST(P999, isTheNineHundredNinetyNinthOfAThousandErrors) {
  std::vector<float> errors;
  for (int i = 0; i < 1000; ++i) errors.push_back(float((i * 7919) % 1000 + 1));  // a permutation
  const auto m = compareVolumes(rowOf(errors), SparseVolume{});
  EXPECT_EQ(m.p999Error, 999.0);
  EXPECT_EQ(m.maxError, 1000.0);
}

}  // namespace
}  // namespace esvr::metrics
