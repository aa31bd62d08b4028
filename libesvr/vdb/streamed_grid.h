#pragma once
/// A grid of OpenVDB that holds no voxels: the leaves get them when they are written, one after the
/// other. The tree of a large volume then takes a tenth of the memory of its voxels.

#include "vdb/scalar_trees.h"
#include "vdb/vector_trees.h"

#include <memory>
#include <utility>

#include "core/parallel.h"
#include "esvr/sparse_volume.h"
#include "esvr/vector_grid.h"

namespace esvr::vdb {

/// The numbers of a volume, which must outlive this object.
struct NumberVoxels {
  const SparseVolume& volume;

  [[nodiscard]] const SparseVolume& bricks() const { return volume; }
  [[nodiscard]] float value(std::size_t b, int i) const { return volume.brickValues(b)[i]; }
};

/// Vectors whose components have the same bricks and active voxels (aligned()).
struct VectorVoxels {
  VectorVolume components;

  [[nodiscard]] const SparseVolume& bricks() const { return components.front(); }
  [[nodiscard]] openvdb::Vec3s value(std::size_t b, int i) const {
    const auto& [x, y, z] = components;
    return {x.brickValues(b)[i], y.brickValues(b)[i], z.brickValues(b)[i]};
  }
};

/// The leaf of a brick. Inactive voxels have the background.
template <class Leaf, class Voxels>
std::unique_ptr<Leaf> makeLeaf(const Voxels& voxels, std::size_t b,
                               const typename Leaf::ValueType& background) {
  using Value = typename Leaf::ValueType;
  const Coord corner = voxels.bricks().brickCorner(b);
  auto leaf = std::make_unique<Leaf>(openvdb::Coord(corner.x, corner.y, corner.z), background);
  const BrickMask& active = voxels.bricks().active[b];
  for (int i = 0; i < kBrickVoxels; ++i)
    if (active.test(i)) leaf->setValueOn(openvdb::Index(i), Value(voxels.value(b, i)));
  return leaf;
}

/// Makes leaves of bricks with active voxels if all voxels are in tiles. Cycles of Blender 3.4 draws
/// nothing of a grid without a leaf, and all of its tiles if there is one. It draws the border of a
/// leaf farther out than that of a tile, so that a single leaf among tiles stands out.
/// All bricks of a small grid therefore remain leaves, and one of a larger grid.
template <class Tree>
void keepLeaves(const SparseVolume& volume, Tree& tree) {
  constexpr std::size_t kMostLeaves = 512;  // a constant leaf takes about 200 bytes of a file
  if (tree.cbeginLeaf()) return;
  const bool keepsAll = volume.brickCount() <= kMostLeaves;
  for (std::size_t b = 0; b < volume.brickCount(); ++b) {
    if (volume.active[b].count() == 0) continue;
    const Coord corner = volume.brickCorner(b);
    tree.touchLeaf(openvdb::Coord(corner.x, corner.y, corner.z));
    if (!keepsAll) return;
  }
}

/// \tparam Voxels  NumberVoxels or VectorVoxels
template <class Tree, class Voxels>
class StreamedGrid : public openvdb::Grid<Tree> {
 public:
  using Leaf = typename Tree::LeafNodeType;
  using Value = typename Tree::ValueType;

  /// \param constantTiles  bricks whose voxels are all active and equal become tiles, unless no
  ///                       leaf would remain (keepLeaves)
  StreamedGrid(Voxels voxels, const Value& background, bool constantTiles)
      : openvdb::Grid<Tree>(background), voxels_(std::move(voxels)) {
    openvdb::tree::ValueAccessor<Tree> accessor(this->tree());
    for (std::size_t b = 0; b < voxels_.bricks().brickCount(); ++b) {
      throwIfCancelled();
      add(b, constantTiles, accessor);
    }
    if (!constantTiles) return;
    mergeTiles();
    keepLeaves(voxels_.bricks(), this->tree());
  }

  /// The bytes that the grid takes where it is read again, with its voxels.
  [[nodiscard]] openvdb::Index64 memUsage() const override {
    return openvdb::tools::memUsageIfLoaded(this->tree());
  }

  void writeBuffers(std::ostream& stream) const override {
    for (auto leaf = this->tree().cbeginLeaf(); leaf; ++leaf) {
      throwIfCancelled();
      const Coord corner{leaf->origin().x(), leaf->origin().y(), leaf->origin().z()};
      const auto b =
          findBrick(voxels_.bricks(), brickOf(corner) - brickOf(voxels_.bricks().origin));
      makeLeaf<Leaf>(voxels_, b.value(), this->background())
          ->writeBuffers(stream, this->saveFloatAsHalf());
    }
  }

 private:
  using Accessor = openvdb::tree::ValueAccessor<Tree>;

  void add(std::size_t b, bool constantTiles, Accessor& accessor) {
    const BrickMask& active = voxels_.bricks().active[b];
    const int count = active.count();
    if (count == 0) return;
    const Coord c = voxels_.bricks().brickCorner(b);
    const openvdb::Coord corner(c.x, c.y, c.z);
    constexpr openvdb::Index kTileOfABrick = 1;  // level in the tree
    if (constantTiles && count == kBrickVoxels && isConstant(b))
      return accessor.addTile(kTileOfABrick, corner, Value(voxels_.value(b, 0)), true);
    auto leaf = std::make_unique<Leaf>(openvdb::PartialCreate{}, corner, this->background());
    leaf->setValueMask(maskOf(active));
    accessor.addLeaf(leaf.release());
  }

  [[nodiscard]] bool isConstant(std::size_t b) const {
    for (int i = 1; i < kBrickVoxels; ++i)
      if (voxels_.value(b, i) != voxels_.value(b, 0)) return false;
    return true;
  }

  static typename Leaf::NodeMaskType maskOf(const BrickMask& active) {
    typename Leaf::NodeMaskType mask;
    for (openvdb::Index w = 0; w < active.words.size(); ++w)
      mask.template getWord<openvdb::Index64>(w) = active.words[w];
    return mask;
  }

  /// Replaces nodes whose tiles are all equal by larger tiles. OpenVDB's prune() would look at the
  /// voxels of leaves.
  void mergeTiles() {
    auto& root = this->tree().root();
    for (auto upper = root.beginChildOn(); upper; ++upper) {
      for (auto lower = upper->beginChildOn(); lower; ++lower)
        mergeInto(*lower,
                  [&](const Value& value, bool isOn) { upper->addTile(lower.pos(), value, isOn); });
      mergeInto(*upper, [&](const Value& value, bool isOn) {
        root.addTile(upper.getCoord(), value, isOn);
      });
    }
  }

  template <class Node, class AddTile>
  static void mergeInto(const Node& node, const AddTile& addTile) {
    Value value{};
    bool isOn = false;
    if (node.isConstant(value, isOn)) addTile(value, isOn);
  }

  Voxels voxels_;
};

}  // namespace esvr::vdb
