#pragma once
/// Decodes bricks of cells from ellipsoids on a CUDA device. Each voxel is summed in integers, as
/// in a fit, so that a brick has the same bits whenever it is decoded and whatever is decoded with
/// it.

#include <cuda_runtime_api.h>

#include "field/voxel_rule.h"
#include "render/brick_march.h"
#include "render/cell_form.h"

namespace esvr::cuda {

/// A CellField on the device.
struct CellFieldView {
  Coord origin;         ///< first voxel of the table
  const Coord* bricks;  ///< by brick: place relative to the origin, in bricks
  const CellForm* forms;
  const KernelConstants<float>* kernels;
  std::uint32_t kernelStride;  ///< 0: one kernel for all ellipsoids; 1: one for each
  const Coord* origins;
  const std::uint32_t *begin, *ellipsoid;
  const std::uint8_t* corners;  ///< null: all voxels may differ from the background
  VoxelRule rule;
};

/// A brick to be decoded and the slot that it gets.
struct SlotOfBrick {
  std::uint32_t brick, slot;
};

struct DecodeArguments {
  CellFieldView field;
  const SlotOfBrick* wanted;
  std::uint32_t count;
  float* const* pages;     ///< see BrickSlotsView
  std::uint32_t* slotOf;   ///< output, by brick: its slot, or BrickSlotsView::kVacant
  std::uint8_t* occupied;  ///< output, by wanted brick: 0 if all of its voxels are the background
};

/// All pointers are to device memory that the caller owns.
void launchDecode(const DecodeArguments& arguments, cudaStream_t stream);

/// Sets slotOf of bricks. \param changes  `count` bricks and their new values
void launchSetSlots(const SlotOfBrick* changes, std::uint32_t count, std::uint32_t* slotOf,
                    cudaStream_t stream);

}  // namespace esvr::cuda
