#pragma once
/// Compares volumes and grids bit by bit.

#include <gtest/gtest.h>

#include <bit>

#include "esvr/vdb_io.h"

namespace esvr::test {

inline void expectSameBits(const SparseVolume& actual, const SparseVolume& expected) {
  EXPECT_EQ(actual.origin, expected.origin);
  EXPECT_EQ(actual.background, expected.background);
  ASSERT_EQ(actual.bricks, expected.bricks);
  ASSERT_EQ(actual.active, expected.active);
  std::size_t different = 0;
  for (std::size_t i = 0; i < expected.values.size(); ++i)
    different += std::bit_cast<std::uint32_t>(actual.values[i]) !=
                 std::bit_cast<std::uint32_t>(expected.values[i]);
  EXPECT_EQ(different, 0u) << "values that differ";
}

inline void expectSame(const VolumeGrid& actual, const VolumeGrid& expected) {
  EXPECT_EQ(actual.descriptor, expected.descriptor);
  expectSameBits(actual.volume, expected.volume);
}

}  // namespace esvr::test
