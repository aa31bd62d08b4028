#pragma once
/// The missing bricks that rays ask for on a CUDA device.

#include <cstdint>

namespace esvr::cuda {

/// The bricks that rays ask for. All pointers are to device memory.
struct BrickDemand {
  struct Counts {
    std::uint32_t bricks;   ///< bricks that are asked for
    std::uint32_t waiting;  ///< tiles with rays that wait
    std::uint32_t free;     ///< free slots
    std::uint32_t spare;    ///< slots that became free while bricks are decoded
  };
  Counts* counts;
  std::uint32_t* slotOf;  ///< see BrickSlotsView; null: no brick can be missing
  std::uint32_t* bricks;  ///< output: bricks that are asked for; room for all
  std::uint32_t* stamps;  ///< output: `now`, for each slot that a ray reads; null: not wanted
  std::uint32_t now;
  int ahead;  ///< missing bricks that a ray asks for besides the one at which it waits
};

}  // namespace esvr::cuda
