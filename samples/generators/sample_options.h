#pragma once
/// The options of all generators.

#include <cstdint>
#include <limits>

#include "esvr/progress.h"

namespace esvr::samples {

/// Limits of a generation.
struct Limits {
  std::uint64_t maxBricks = std::numeric_limits<std::uint64_t>::max();  ///< then DeviceError
  const CancelToken* cancel = nullptr;                                  ///< then Cancelled
};

struct SampleOptions {
  int resolution = 128;  ///< voxels along the longest side of what the sample shows
  std::uint64_t seed = 1;
  int frame = 0;  ///< frame of a sample that moves (SampleKind::moves), from 0
  Limits limits{};
};

}  // namespace esvr::samples
