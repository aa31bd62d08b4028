#pragma once
/// A sample of a volume's bricks, which stands for the whole volume in estimates.

#include <cstddef>

#include "esvr/volume.h"

namespace esvr::convert {

/// The bricks of a sample lie in runs at equal distances. The bricks of a run follow each other in
/// the order in which voxels are coded, so that most of them are neighbours.
struct SampleSize {
  std::size_t bricks = 1;  ///< at least `runs`
  std::size_t runs = 1;    ///< at least 1
};

/// About size.bricks bricks of a volume at their positions; the whole volume if it has no more.
[[nodiscard]] SparseVolume sampleOf(const SparseVolume& volume, const SampleSize& size);

}  // namespace esvr::convert
