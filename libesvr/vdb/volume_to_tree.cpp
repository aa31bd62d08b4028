#include "vdb/volume_to_tree.h"

#include <openvdb/tools/Prune.h>
#include <openvdb/tools/SignedFloodFill.h>
#include "vdb/trees.h"

#include <cmath>

#include "esvr/empty_signs.h"
#include "esvr/error.h"
#include "esvr/grid_names.h"
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
          makeLeaf<typename Tree::LeafNodeType>(NumberVoxels{volume}, b, tree.background())
              .release());
}

template <class Tree>
typename openvdb::Grid<Tree>::Ptr makeGrid(const VolumeGrid& source, const WriteOptions& options,
                                           LeafVoxels voxels) {
  const auto background = typename Tree::ValueType(source.descriptor.background);
  const bool levelSet = source.descriptor.gridClass == GridClass::kLevelSet;
  // The flood fill of a level set needs the voxels of all leaves.
  if (voxels == LeafVoxels::kWhenWritten && !levelSet)
    return std::make_shared<StreamedGrid<Tree, NumberVoxels>>(NumberVoxels{source.volume},
                                                              background, options.constantTiles);
  auto grid = openvdb::Grid<Tree>::create(background);
  Tree& tree = grid->tree();
  addLeaves(source.volume, tree);
  // The flood fill overwrites active tiles, so it runs before there are any.
  if (levelSet && background > 0 && EmptySigns(source.volume).agree())
    openvdb::tools::signedFloodFill(tree);
  if (options.constantTiles) {
    openvdb::tools::prune(tree);
    keepLeaves(NumberVoxels{source.volume}, tree);
  }
  return grid;
}

bool isHalf(float value) { return float(openvdb::math::half(value)) == value; }
bool fitsHalf(float value) { return std::isfinite(float(openvdb::math::half(value))); }

/// True if all active voxels and the background are numbers of a kind.
template <class Test>
bool allAre(const SparseVolume& volume, double background, const Test& test) {
  bool all = test(float(background));
  for (std::size_t b = 0; all && b < volume.brickCount(); ++b)
    for (int i = 0; i < kBrickVoxels; ++i)
      if (volume.active[b].test(i)) all &= test(volume.brickValues(b)[i]);
  return all;
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

/// True if a grid is saved as half without being asked for: its values are those of a source of
/// halfs, and none is beyond them; or the source was saved as half in another way, such as doubles
/// are, and halfs hold every value exactly. Otherwise rounding would add an error that no bound of
/// the conversion includes.
/// \param all  tells whether all values pass a test
template <class All>
bool remainsHalf(const GridDescriptor& descriptor, const All& all, const GridBase& grid) {
  if (descriptor.valueType == ValueType::kHalf) return all(fitsHalf);
  return grid.saveFloatAsHalf() && all(isHalf);
}

/// \throws UsageError  halfs are asked for, and a value is beyond them
template <class All>
void chooseHalf(const GridDescriptor& descriptor, const WriteOptions& options, const All& all,
                GridBase& grid) {
  const bool half = options.half == HalfMode::kOn ||
                    (options.half == HalfMode::kAuto && remainsHalf(descriptor, all, grid));
  if (half && !all(fitsHalf))
    throw UsageError("grid \"" + descriptor.name +
                     "\" has values beyond 65504, the largest that half precision holds; do not "
                     "ask for halfs");
  if (half != grid.saveFloatAsHalf()) grid.setSaveFloatAsHalf(half);
}

template <class Tree>
GridBase::Ptr makeVectors(const VectorGrid& source, const WriteOptions& options) {
  using Vector = typename Tree::ValueType;
  const openvdb::Vec3d background(source.background.data());
  return std::make_shared<StreamedGrid<Tree, VectorVoxels>>(
      VectorVoxels{aligned(source.components)}, Vector(background), options.constantTiles);
}

template <class T>
GridBase::Ptr makePacked(const PackedVoxels<T>& voxels, const WriteOptions& options) {
  using Tree = typename openvdb::tree::Tree4<decltype(openVdbValue(voxels.background))>::Type;
  return std::make_shared<StreamedGrid<Tree, StreamedPacked<T>>>(
      StreamedPacked<T>{voxels}, openVdbValue(voxels.background), options.constantTiles);
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
  const auto all = [&](const auto& test) {
    return allAre(source.volume, source.descriptor.background, test);
  };
  chooseHalf(source.descriptor, options, all, *grid);
  return grid;
}

GridBase::Ptr makeOpenVdbGrid(const VectorGrid& source, const WriteOptions& options) {
  initializeOpenVdb();
  GridBase::Ptr grid = source.descriptor.valueType == ValueType::kDouble
                           ? makeVectors<openvdb::Vec3DTree>(source, options)
                           : makeVectors<openvdb::Vec3STree>(source, options);
  restoreDescriptor(source.descriptor, *grid);
  const auto all = [&](const auto& test) {
    bool passed = true;
    for (std::size_t c = 0; passed && c < kComponents; ++c)
      passed = allAre(source.components[c], source.background[c], test);
    return passed;
  };
  chooseHalf(source.descriptor, options, all, *grid);
  return grid;
}

GridBase::Ptr makeOpenVdbGrid(const PackedGrid& source, const WriteOptions& options) {
  initializeOpenVdb();
  const GridBase::Ptr grid =
      std::visit([&](const auto& voxels) { return makePacked(voxels, options); }, source.voxels);
  restoreDescriptor(source.descriptor, *grid);
  // Halfs remain only where they were read, so that they hold all values.
  if (source.descriptor.valueType != ValueType::kHalf && grid->saveFloatAsHalf())
    grid->setSaveFloatAsHalf(false);
  return grid;
}

}  // namespace esvr::vdb
