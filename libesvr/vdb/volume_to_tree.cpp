#include "vdb/volume_to_tree.h"

#include <openvdb/tools/Prune.h>
#include <openvdb/tools/SignedFloodFill.h>
#include "vdb/scalar_trees.h"
#include "vdb/vector_trees.h"

#include <cmath>

#include "esvr/empty_signs.h"
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
          makeLeaf<typename Tree::LeafNodeType>(NumberVoxels(volume), b, tree.background())
              .release());
}

template <class Tree>
typename openvdb::Grid<Tree>::Ptr makeGrid(const VolumeGrid& source, const WriteOptions& options,
                                           LeafVoxels voxels) {
  const auto background = typename Tree::ValueType(source.descriptor.background);
  const bool levelSet = source.descriptor.gridClass == GridClass::kLevelSet;
  // The flood fill of a level set needs the voxels of all leaves.
  if (voxels == LeafVoxels::kWhenWritten && !levelSet)
    return std::make_shared<StreamedGrid<Tree, NumberVoxels>>(NumberVoxels(source.volume),
                                                              background, options.constantTiles);
  auto grid = openvdb::Grid<Tree>::create(background);
  Tree& tree = grid->tree();
  addLeaves(source.volume, tree);
  // The flood fill overwrites active tiles, so it runs before there are any.
  if (levelSet && background > 0 && EmptySigns(source.volume).agree())
    openvdb::tools::signedFloodFill(tree);
  if (options.constantTiles) openvdb::tools::prune(tree);
  return grid;
}

bool wantsHalf(const GridDescriptor& descriptor, const GridBase& grid, HalfMode mode) {
  if (mode != HalfMode::kAuto) return mode == HalfMode::kOn;
  return descriptor.valueType == ValueType::kHalf || grid.saveFloatAsHalf();
}

bool fitsHalf(float value) { return std::isfinite(float(openvdb::math::half(value))); }

void refuseBeyondHalf(const std::string& name, double background, const SparseVolume& volume) {
  bool fits = fitsHalf(float(background));
  for (std::size_t b = 0; fits && b < volume.brickCount(); ++b)
    for (int i = 0; i < kBrickVoxels; ++i)
      if (volume.active[b].test(i)) fits &= fitsHalf(volume.brickValues(b)[i]);
  if (!fits)
    throw UsageError("grid \"" + name +
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

/// Saves a grid as half where the options or the source want it.
/// \param fits  refuses values that half cannot hold
template <class Fits>
void chooseHalf(const GridDescriptor& descriptor, const WriteOptions& options, const Fits& fits,
                GridBase& grid) {
  const bool half = wantsHalf(descriptor, grid, options.half);
  if (half) fits();
  if (half != grid.saveFloatAsHalf()) grid.setSaveFloatAsHalf(half);
}

template <class Tree>
GridBase::Ptr makeVectors(const VectorGrid& source, const WriteOptions& options) {
  using Vector = typename Tree::ValueType;
  const openvdb::Vec3d background(source.background.data());
  return std::make_shared<StreamedGrid<Tree, VectorVoxels>>(
      VectorVoxels(std::make_shared<const VectorVolume>(aligned(source.components))),
      Vector(background), options.constantTiles);
}

/// OpenVDB's tree for a type of PackedVoxels.
template <class T>
using TreeOf =
    std::conditional_t<std::is_same_v<T, PackedVector>, openvdb::Vec3STree,
                       typename openvdb::tree::Tree4<
                           std::conditional_t<std::is_same_v<T, PackedVector>, float, T>>::Type>;

template <class T>
GridBase::Ptr makePacked(const PackedVoxels<T>& voxels, const WriteOptions& options) {
  using Tree = TreeOf<T>;
  const auto background = [&] {
    if constexpr (std::is_same_v<T, PackedVector>)
      return openvdb::Vec3s(voxels.background.data());
    else
      return voxels.background;
  }();
  return std::make_shared<StreamedGrid<Tree, StreamedPacked<T>>>(StreamedPacked<T>{voxels},
                                                                 background, options.constantTiles);
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
  chooseHalf(
      source.descriptor, options,
      [&] {
        refuseBeyondHalf(source.descriptor.name, source.descriptor.background, source.volume);
      },
      *grid);
  return grid;
}

GridBase::Ptr makeOpenVdbGrid(const VectorGrid& source, const WriteOptions& options) {
  initializeOpenVdb();
  GridBase::Ptr grid = source.descriptor.valueType == ValueType::kDouble
                           ? makeVectors<openvdb::Vec3DTree>(source, options)
                           : makeVectors<openvdb::Vec3STree>(source, options);
  restoreDescriptor(source.descriptor, *grid);
  const auto fits = [&] {
    for (std::size_t c = 0; c < kComponents; ++c)
      refuseBeyondHalf(source.descriptor.name, source.background[c], source.components[c]);
  };
  chooseHalf(source.descriptor, options, fits, *grid);
  return grid;
}

GridBase::Ptr makeOpenVdbGrid(const PackedGrid& source, const WriteOptions& options) {
  initializeOpenVdb();
  const GridBase::Ptr grid =
      std::visit([&](const auto& voxels) { return makePacked(voxels, options); }, source.voxels);
  restoreDescriptor(source.descriptor, *grid);
  return grid;
}

}  // namespace esvr::vdb
