#include "vdb/volume_to_tree.h"

#include <openvdb/tools/Prune.h>
#include <openvdb/tools/SignedFloodFill.h>
#include "vdb/scalar_trees.h"

#include <cmath>

#include "esvr/error.h"
#include "vdb/metadata.h"
#include "vdb/streamed_grid.h"
#include "vdb/transform.h"

namespace esvr::vdb {
namespace {

using openvdb::GridBase;

openvdb::GridClass openVdbClass(GridClass gridClass) {
  switch (gridClass) {
    case GridClass::kLevelSet:
      return openvdb::GRID_LEVEL_SET;
    case GridClass::kFogVolume:
      return openvdb::GRID_FOG_VOLUME;
    case GridClass::kStaggered:
      return openvdb::GRID_STAGGERED;
    case GridClass::kUnknown:
      break;
  }
  return openvdb::GRID_UNKNOWN;
}

template <class Tree>
void addLeaves(const SparseVolume& volume, Tree& tree) {
  openvdb::tree::ValueAccessor<Tree> accessor(tree);
  for (std::size_t b = 0; b < volume.brickCount(); ++b)
    if (volume.active[b].count() > 0)
      accessor.addLeaf(
          makeLeaf<typename Tree::LeafNodeType>(volume, b, tree.background()).release());
}

template <class Tree>
typename openvdb::Grid<Tree>::Ptr makeGrid(const VolumeGrid& source, const WriteOptions& options,
                                           LeafVoxels voxels) {
  const auto background = typename Tree::ValueType(source.descriptor.background);
  const bool levelSet = source.descriptor.gridClass == GridClass::kLevelSet;
  // The flood fill of a level set needs the voxels of all leaves.
  if (voxels == LeafVoxels::kWhenWritten && !levelSet)
    return std::make_shared<StreamedGrid<Tree>>(source.volume, background, options.constantTiles);
  auto grid = openvdb::Grid<Tree>::create(background);
  Tree& tree = grid->tree();
  addLeaves(source.volume, tree);
  // The flood fill overwrites active tiles, so it runs before there are any.
  if (levelSet && background > 0) openvdb::tools::signedFloodFill(tree);
  if (options.constantTiles) openvdb::tools::prune(tree);
  return grid;
}

bool wantsHalf(const GridDescriptor& descriptor, const GridBase& grid, HalfMode mode) {
  if (mode != HalfMode::kAuto) return mode == HalfMode::kOn;
  return descriptor.valueType == ValueType::kHalf || grid.saveFloatAsHalf();
}

bool fitsHalf(float value) { return std::isfinite(float(openvdb::math::half(value))); }

void refuseBeyondHalf(const VolumeGrid& grid) {
  const SparseVolume& volume = grid.volume;
  bool fits = fitsHalf(float(grid.descriptor.background));
  for (std::size_t b = 0; fits && b < volume.brickCount(); ++b)
    for (int i = 0; i < kBrickVoxels; ++i)
      if (volume.active[b].test(i)) fits &= fitsHalf(volume.brickValues(b)[i]);
  if (!fits)
    throw UsageError("grid \"" + grid.descriptor.name +
                     "\" has values beyond 65504, the largest that half precision holds");
}

/// Restores the properties in the source's metadata and then those in the descriptor, because a
/// descriptor that was made from scratch has no metadata.
void restoreDescriptor(const GridDescriptor& descriptor, GridBase& grid) {
  insertItems(descriptor.metadata, grid);
  if (grid.getName() != descriptor.name) grid.setName(descriptor.name);
  const auto gridClass = openVdbClass(descriptor.gridClass);
  if (grid.getGridClass() != gridClass) grid.setGridClass(gridClass);
  grid.setTransform(toOpenVdb(descriptor.transform));
}

}  // namespace

GridBase::Ptr makeOpenVdbGrid(const VolumeGrid& source, const WriteOptions& options,
                              LeafVoxels voxels) {
  initializeOpenVdb();
  GridBase::Ptr grid;
  if (source.descriptor.valueType == ValueType::kDouble)
    grid = makeGrid<openvdb::DoubleTree>(source, options, voxels);
  else
    grid = makeGrid<openvdb::FloatTree>(source, options, voxels);
  restoreDescriptor(source.descriptor, *grid);
  const bool half = wantsHalf(source.descriptor, *grid, options.half);
  if (half) refuseBeyondHalf(source);
  if (half != grid->saveFloatAsHalf()) grid->setSaveFloatAsHalf(half);
  return grid;
}

}  // namespace esvr::vdb
