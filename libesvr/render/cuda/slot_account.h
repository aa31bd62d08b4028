#pragma once
/// Kernels that keep account of which brick has which slot (BrickSlotsView).

#include <cuda_runtime_api.h>

#include <cstdint>

#include "render/cuda/brick_demand.h"

namespace esvr::cuda {

/// All pointers are to device memory.
struct SlotAccount {
  std::uint32_t* slotOf;  ///< by brick
  std::uint32_t* owners;  ///< by slot: its brick, or kNoOwner
  std::uint32_t* stamps;  ///< by slot: time of the last reading
  std::uint32_t* free;    ///< slots without an owner; the first `counts->free`
  std::uint32_t* spare;   ///< memory for as many slots
  BrickDemand::Counts* counts;
  std::uint32_t now;
};

/// Bricks that have been decoded.
struct DecodedBricks {
  const std::uint32_t* bricks;
  std::uint32_t count;
  std::uint32_t freeBefore;      ///< brick n was decoded into slot free[freeBefore - 1 - n]
  const std::uint8_t* occupied;  ///< 0: all voxels are the background
};

/// Sets the slots of bricks to one value.
void launchSetAll(std::uint32_t* slotOf, std::uint32_t bricks, std::uint32_t value,
                  cudaStream_t stream);
/// The listed bricks become missing.
void launchMakeMissing(const SlotAccount& account, const std::uint32_t* bricks, std::uint32_t count,
                       cudaStream_t stream);
/// Adds slots from `first` on to the free ones. \param before  number of free slots before
void launchAddFree(const SlotAccount& account, std::uint32_t first, std::uint32_t count,
                   std::uint32_t before, cudaStream_t stream);
/// Takes slots away from their bricks. \param before  number of free slots before
void launchDrop(const SlotAccount& account, const std::uint32_t* slots, std::uint32_t count,
                std::uint32_t before, cudaStream_t stream);
/// Gives decoded bricks their slots, and takes back those of vacant ones. Sets counts->free.
void launchSettle(const SlotAccount& account, const DecodedBricks& decoded, cudaStream_t stream);

}  // namespace esvr::cuda
