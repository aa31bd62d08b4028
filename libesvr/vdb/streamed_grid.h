#pragma once
/// A grid of OpenVDB that holds no voxels: the leaves get them when they are written, one after the
/// other. The tree of a large volume then takes a tenth of the memory of its voxels.

#include "vdb/trees.h"

#include <algorithm>
#include <memory>
#include <type_traits>
#include <utility>

#include "core/parallel.h"
#include "esvr/packed_grid.h"
#include "esvr/sparse_volume.h"
#include "esvr/vector_grid.h"

namespace esvr::vdb {

// Voxels that a StreamedGrid writes have these functions: count() is the number of bricks, corner(b) and
// active(b) describe a brick, find(corner) is its number, and value(b, i, n) is the value at the offset i
// (voxelOffset), which is the n-th active one of the brick.

/// The numbers of a volume, which must outlive this object.
struct NumberVoxels {
  const SparseVolume& volume;

  [[nodiscard]] std::size_t count() const { return volume.brickCount(); }
  [[nodiscard]] Coord corner(std::size_t b) const { return volume.brickCorner(b); }
  [[nodiscard]] const BrickMask& active(std::size_t b) const { return volume.active[b]; }
  [[nodiscard]] std::size_t find(Coord corner) const {
    return findBrick(volume, brickOf(corner) - brickOf(volume.origin)).value();
  }
  [[nodiscard]] float value(std::size_t b, int i, int) const { return volume.brickValues(b)[i]; }
};

/// Vectors whose components have the same bricks and active voxels (aligned()).
struct VectorVoxels {
  VectorVolume components;

  [[nodiscard]] NumberVoxels bricks() const { return {components.front()}; }
  [[nodiscard]] std::size_t count() const { return bricks().count(); }
  [[nodiscard]] Coord corner(std::size_t b) const { return bricks().corner(b); }
  [[nodiscard]] const BrickMask& active(std::size_t b) const {
    return components.front().active[b];
  }
  [[nodiscard]] std::size_t find(Coord corner) const { return bricks().find(corner); }
  [[nodiscard]] openvdb::Vec3s value(std::size_t b, int i, int) const {
    const auto& [x, y, z] = components;
    return {x.brickValues(b)[i], y.brickValues(b)[i], z.brickValues(b)[i]};
  }
};

/// A value of PackedVoxels in OpenVDB's type.
template <class T>
auto openVdbValue(const T& value) {
  if constexpr (std::is_same_v<T, PackedVector>)
    return openvdb::Vec3s(value.data());
  else
    return value;
}

/// The voxels of a PackedGrid, which must outlive this object.
template <class T>
struct StreamedPacked {
  const PackedVoxels<T>& voxels;

  [[nodiscard]] std::size_t count() const { return voxels.bricks.size(); }
  [[nodiscard]] Coord corner(std::size_t b) const { return voxels.bricks[b].corner; }
  [[nodiscard]] const BrickMask& active(std::size_t b) const { return voxels.bricks[b].active; }
  [[nodiscard]] std::size_t find(Coord corner) const {
    const auto at = std::ranges::lower_bound(voxels.bricks, corner, {}, &PackedBrick::corner);
    return std::size_t(at - voxels.bricks.begin());
  }
  [[nodiscard]] auto value(std::size_t b, int, int n) const {
    return openVdbValue(voxels.value(b, n));
  }
};

/// The leaf of a brick. Inactive voxels have the background.
template <class Leaf, class Voxels>
std::unique_ptr<Leaf> makeLeaf(const Voxels& voxels, std::size_t b,
                               const typename Leaf::ValueType& background) {
  using Value = typename Leaf::ValueType;
  const Coord corner = voxels.corner(b);
  auto leaf = std::make_unique<Leaf>(openvdb::Coord(corner.x, corner.y, corner.z), background);
  forEachActive(voxels.active(b), [&, n = 0](int i) mutable {
    leaf->setValueOn(openvdb::Index(i), Value(voxels.value(b, i, n++)));
  });
  return leaf;
}

/// Makes leaves of bricks with active voxels if all voxels are in tiles. Cycles of Blender 3.4 draws
/// nothing of a grid without a leaf, and all of its tiles if there is one. It draws the border of a
/// leaf farther out than that of a tile, so that a single leaf among tiles stands out.
/// All bricks of a small grid therefore remain leaves, and one of a larger grid.
template <class Tree, class Voxels>
void keepLeaves(const Voxels& voxels, Tree& tree) {
  constexpr std::size_t kMostLeaves = 512;  // a constant leaf takes about 200 bytes of a file
  if (tree.cbeginLeaf()) return;
  const bool keepsAll = voxels.count() <= kMostLeaves;
  for (std::size_t b = 0; b < voxels.count(); ++b) {
    if (voxels.active(b).count() == 0) continue;
    const Coord corner = voxels.corner(b);
    tree.touchLeaf(openvdb::Coord(corner.x, corner.y, corner.z));
    if (!keepsAll) return;
  }
}

/// \tparam Voxels  NumberVoxels, VectorVoxels or StreamedPacked
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
    for (std::size_t b = 0; b < voxels_.count(); ++b) {
      throwIfCancelled();
      add(b, constantTiles, accessor);
    }
    if (!constantTiles) return;
    mergeTiles();
    keepLeaves(voxels_, this->tree());
  }

  /// The bytes that the grid takes where it is read again, with its voxels.
  [[nodiscard]] openvdb::Index64 memUsage() const override {
    return openvdb::tools::memUsageIfLoaded(this->tree());
  }

  void writeBuffers(std::ostream& stream) const override {
    for (auto leaf = this->tree().cbeginLeaf(); leaf; ++leaf) {
      throwIfCancelled();
      const Coord corner{leaf->origin().x(), leaf->origin().y(), leaf->origin().z()};
      makeLeaf<Leaf>(voxels_, voxels_.find(corner), this->background())
          ->writeBuffers(stream, this->saveFloatAsHalf());
    }
  }

 private:
  using Accessor = openvdb::tree::ValueAccessor<Tree>;

  void add(std::size_t b, bool constantTiles, Accessor& accessor) {
    const BrickMask& active = voxels_.active(b);
    const int count = active.count();
    if (count == 0) return;
    const Coord c = voxels_.corner(b);
    const openvdb::Coord corner(c.x, c.y, c.z);
    constexpr openvdb::Index kTileOfABrick = 1;  // level in the tree
    if (constantTiles && count == kBrickVoxels && isConstant(b))
      return accessor.addTile(kTileOfABrick, corner, Value(voxels_.value(b, 0, 0)), true);
    auto leaf = std::make_unique<Leaf>(openvdb::PartialCreate{}, corner, this->background());
    leaf->setValueMask(maskOf(active));
    accessor.addLeaf(leaf.release());
  }

  [[nodiscard]] bool isConstant(std::size_t b) const {
    for (int i = 1; i < kBrickVoxels; ++i)
      if (voxels_.value(b, i, i) != voxels_.value(b, 0, 0)) return false;
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
