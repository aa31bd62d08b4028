#pragma once
/// NanoVDB grids in memory, for the reference renderer (renderNano).

#include <cstddef>
#include <memory>

#include "esvr/vdb_io.h"

namespace esvr {

/// The value type of a NanoVDB grid. Quantised types have a range of values for each leaf; FpN also
/// has a number of bits for each leaf. The background within a leaf may have an error of half a
/// step, and is then drawn like any other value.
enum class NanoValues { kFloat, kFp4, kFp8, kFp16, kFpN };

/// A NanoVDB grid in the index space of the volume. Voxels outside its leaves are the background.
struct NanoVolume {
  NanoValues values = NanoValues::kFloat;
  std::shared_ptr<const std::byte[]> data;  ///< NanoVDB's grid buffer, aligned to 32 bytes
  std::size_t bytes = 0;
  float background = 0.0f;
  Box voxels;  ///< bounding box of the leaves; empty if there are none
};

/// Makes a NanoVDB grid without dithering. Level sets lose the sign of their inactive voxels.
/// \throws std::logic_error  the volume violates its invariants (checkInvariants)
[[nodiscard]] NanoVolume makeNanoVolume(const VolumeGrid& grid, NanoValues values);

}  // namespace esvr
