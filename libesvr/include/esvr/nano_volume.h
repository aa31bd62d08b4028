#pragma once
/// NanoVDB grids in memory: the voxels that the reference renderer marches.

#include <cstddef>
#include <memory>

#include "esvr/vdb_io.h"

namespace esvr {

/// How a NanoVDB grid holds its values. The quantised ones have for each leaf its own range, FpN
/// its own number of bits too; within a leaf their background may be off by half a step, and is
/// then drawn as any value.
enum class NanoValues { kFloat, kFp4, kFp8, kFp16, kFpN };

/// A NanoVDB grid whose index space is the volume's. Its voxels lie in leaves; what no leaf holds
/// is the background.
struct NanoVolume {
  NanoValues values = NanoValues::kFloat;
  std::shared_ptr<const std::byte[]>
      data;  ///< the grid as NanoVDB lays it out, aligned to 32 bytes
  std::size_t bytes = 0;
  float background = 0.0f;
  Box voxels;  ///< around the leaves; empty where there are none
};

/// Without dithering. Level sets lose the sign of what is not active, as SparseVolume has it.
/// \throws std::logic_error  the volume's arrays do not fit each other
[[nodiscard]] NanoVolume makeNanoVolume(const VolumeGrid& grid, NanoValues values);

}  // namespace esvr
