#pragma once
/// Decodes bricks of cells from ellipsoids on a CUDA device. Each voxel is summed in integers, as
/// in a fit, so that a brick has the same bits whenever it is decoded and whatever is decoded with
/// it. Bricks of coarser levels of detail hold means of these voxels.

#include <cuda_runtime_api.h>

#include "esvr/sparse_volume.h"
#include "field/voxel_rule.h"
#include "render/brick_march.h"
#include "render/cell_form.h"
#include "render/level_of_detail.h"

namespace esvr::cuda {

/// The bricks of a level of detail; see DeviceLevel.
struct LevelBricks {
  Coord origin;         ///< first voxel of the table, in voxels of the level
  std::uint32_t first;  ///< number of the level's first brick
  std::uint32_t count;
  const Coord* bricks;
};

/// A CellField on the device.
struct CellFieldView {
  BrickTableView table;  ///< of level 0
  LevelBricks levels[kLevels];
  const CellForm* forms;
  const KernelConstants<float>* kernels;
  std::uint32_t kernelStride;  ///< 0: one kernel for all ellipsoids; 1: one for each
  const Coord* origins;
  const std::uint32_t *begin, *ellipsoid;
  const std::uint8_t* corners;  ///< null: all voxels may differ from the background
  /// Masks of active voxels, or levels of their thresholds; null: there are none. Their numbers by
  /// brick and corner, or kNoRule.
  static constexpr std::uint32_t kNoRule = 0xffffffffu;
  const BrickMask* masks;
  const BlockLevels* blockLevels;
  const std::uint32_t* ruleOf;
  Box box;  ///< no voxel outside it is active
  VoxelRule rule;
};

struct DecodeArguments {
  CellFieldView field;
  const std::uint32_t* bricks;  ///< bricks to decode
  std::uint32_t count;
  const std::uint32_t* lastSlot;  ///< brick n gets the slot that lies n places before this one
  float* const* pages;            ///< see BrickSlotsView
  std::uint8_t* occupied;  ///< output, by brick: 1 if a voxel is not the background; must be 0
};

/// Decodes those of the bricks that belong to a level. All pointers are to device memory that the
/// caller owns.
void launchDecode(const DecodeArguments& arguments, int level, cudaStream_t stream);

}  // namespace esvr::cuda
