#pragma once
/// A grid of OpenVDB that holds no voxels: the leaves get them when they are written, one after the
/// other. The tree of a large volume then takes a tenth of the memory of its voxels.

#include "vdb/scalar_trees.h"

#include <algorithm>
#include <memory>

#include "esvr/sparse_volume.h"

namespace esvr::vdb {

/// The leaf of a brick. Inactive voxels have the background.
template <class Leaf>
std::unique_ptr<Leaf> makeLeaf(const SparseVolume& volume, std::size_t b,
                               typename Leaf::ValueType background) {
  const Coord corner = volume.brickCorner(b);
  auto leaf = std::make_unique<Leaf>(openvdb::Coord(corner.x, corner.y, corner.z), background);
  const auto values = volume.brickValues(b);
  const BrickMask& active = volume.active[b];
  for (int i = 0; i < kBrickVoxels; ++i)
    if (active.test(i)) leaf->setValueOn(openvdb::Index(i), values[i]);
  return leaf;
}

template <class Tree>
class StreamedGrid : public openvdb::Grid<Tree> {
 public:
  using Leaf = typename Tree::LeafNodeType;
  using Value = typename Tree::ValueType;

  /// \param volume         must outlive the grid
  /// \param constantTiles  bricks whose voxels are all active and equal become tiles
  StreamedGrid(const SparseVolume& volume, Value background, bool constantTiles)
      : openvdb::Grid<Tree>(background), volume_(volume) {
    openvdb::tree::ValueAccessor<Tree> accessor(this->tree());
    for (std::size_t b = 0; b < volume.brickCount(); ++b) add(b, constantTiles, accessor);
    if (constantTiles) mergeTiles();
  }

  void writeBuffers(std::ostream& stream) const override {
    for (auto leaf = this->tree().cbeginLeaf(); leaf; ++leaf) {
      const Coord corner{leaf->origin().x(), leaf->origin().y(), leaf->origin().z()};
      const auto b = findBrick(volume_, brickOf(corner) - brickOf(volume_.origin));
      makeLeaf<Leaf>(volume_, b.value(), this->background())
          ->writeBuffers(stream, this->saveFloatAsHalf());
    }
  }

 private:
  using Accessor = openvdb::tree::ValueAccessor<Tree>;

  void add(std::size_t b, bool constantTiles, Accessor& accessor) {
    const BrickMask& active = volume_.active[b];
    const int count = active.count();
    if (count == 0) return;
    const Coord c = volume_.brickCorner(b);
    const openvdb::Coord corner(c.x, c.y, c.z);
    constexpr openvdb::Index kTileOfABrick = 1;  // level in the tree
    if (constantTiles && count == kBrickVoxels && isConstant(volume_.brickValues(b)))
      return accessor.addTile(kTileOfABrick, corner, volume_.brickValues(b).front(), true);
    auto leaf = std::make_unique<Leaf>(openvdb::PartialCreate{}, corner, this->background());
    leaf->setValueMask(maskOf(active));
    accessor.addLeaf(leaf.release());
  }

  static bool isConstant(std::span<const float> values) {
    return std::ranges::all_of(values, [&](float v) { return v == values.front(); });
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
                  [&](Value value, bool isOn) { upper->addTile(lower.pos(), value, isOn); });
      mergeInto(*upper,
                [&](Value value, bool isOn) { root.addTile(upper.getCoord(), value, isOn); });
    }
  }

  template <class Node, class AddTile>
  static void mergeInto(const Node& node, const AddTile& addTile) {
    Value value{};
    bool isOn = false;
    if (node.isConstant(value, isOn)) addTile(value, isOn);
  }

  const SparseVolume& volume_;
};

}  // namespace esvr::vdb
