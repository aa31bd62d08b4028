#pragma once
/// Codes the voxels of a frame with the voxels of the previous frame as context (docs/format.md,
/// "Frames"). A brick may be a copy of the previous frame at a motion. In all other bricks, each
/// voxel is predicted from the voxels before it and from the previous frame around it.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "codec/past_voxels.h"
#include "codec/range_coder.h"
#include "esvr/quantised.h"
#include "esvr/volume.h"

namespace esvr::codec {

/// What chooseFrameCodes() weighs.
struct FrameThrift {
  std::vector<double> exact;  ///< the voxels in units of the lattice, as the layer's codes
  double bitPrice = 0.0;      ///< squared error, in the same units, that a bit is worth
  double steadiness = 0.0;    ///< share of the previous frame's errors that is kept
  RoundedSigns signs = RoundedSigns::kMayChange;  ///< kKept: a code keeps its sign
};

/// Codes the positions of the bricks of a frame. A reader sets `bricks`.
/// \param maxNew  largest number of bricks that neither are in the previous frame nor touch it
/// \throws BadInput  a reader finds more of these, or a brick twice
void codeFrameBricks(Writer& side, const PastVoxels& past, std::vector<Coord>& bricks);
void codeFrameBricks(Reader& side, const PastVoxels& past, std::uint64_t maxNew,
                     std::vector<Coord>& bricks);

/// Replaces codes by codes near them, as chooseCodes() does for a volume of its own.
void chooseFrameCodes(std::span<const std::size_t> order, const PastVoxels& past,
                      const FrameThrift& thrift, VoxelLayer& layer);

/// Writes the bricks in the given order, which must be that of codeVoxels().
void codeFrameVoxels(Writer& side, std::span<const std::size_t> order, const PastVoxels& past,
                     VoxelLayer& layer);
/// Reads the codes and masks of a layer whose bricks are set.
/// \throws BadInput  a code is out of range
void codeFrameVoxels(Reader& side, std::span<const std::size_t> order, const PastVoxels& past,
                     VoxelLayer& layer);

}  // namespace esvr::codec
