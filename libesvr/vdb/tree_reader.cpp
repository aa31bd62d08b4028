#include "vdb/tree_reader.h"

#include "vdb/versions.h"

#include "vdb/scalar_trees.h"

#include <stdexcept>

#include "esvr/error.h"
#include "vdb/brick_filler.h"

namespace esvr::vdb {
namespace {

/// Access to the leaves of OpenVDB for buildVolume. Their voxels are in voxelOffset order.
template <class Leaf>
struct LeafAccess {
  static auto value(const Leaf& leaf, int i) { return leaf.buffer().data()[i]; }
  static BrickMask mask(const Leaf& leaf) {
    BrickMask mask;
    for (openvdb::Index w = 0; w < mask.words.size(); ++w)
      mask.words[w] = leaf.valueMask().template getWord<openvdb::Index64>(w);
    return mask;
  }
};

Coord toCoord(const openvdb::Coord& c) { return {c.x(), c.y(), c.z()}; }

/// The position and the head of an entry's tree.
struct LocatedTree {
  const ArchiveEntry& owner;
  GridHead head;
  TreeSurvey survey;
};

LocatedTree locateTree(Archive& archive, const ArchiveEntry& entry) {
  const ArchiveEntry& owner = archive.treeOwner(entry);
  if (owner.treeType != entry.treeType)
    throw BadInput("is damaged: it shares the voxels of a grid of another type");
  GridHead head = archive.readHead(owner);
  const std::uint64_t valueBytes = entry.valueType() == "double" ? sizeof(double) : sizeof(float);
  const auto survey = surveyTree(archive.file(), {valueBytes, owner.savedAsHalf, head.compression});
  return {owner, std::move(head), survey};
}

/// Reads a tree with its voxels. OpenVDB cannot map this stream into memory and load voxels later.
template <class Tree>
Tree readTree(Archive& archive, const LocatedTree& located) {
  InputFile& file = archive.file();
  file.seek(located.head.treeAt);
  openvdb::io::setDataCompression(file.stream(), located.head.compression);
  Tree tree;
  tree.readTopology(file.stream(), located.owner.savedAsHalf);
  tree.readBuffers(file.stream(), located.owner.savedAsHalf);
  return tree;
}

template <class Tree>
auto brickSources(const Tree& tree, std::uint64_t bricks) {
  std::vector<BrickSource<typename Tree::LeafNodeType>> sources;
  sources.reserve(bricks);
  for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf)
    sources.push_back({toCoord(leaf->origin()), leaf.getLeaf()});
  auto tile = tree.cbeginValueOn();
  tile.setMaxDepth(Tree::ValueOnCIter::LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    openvdb::CoordBBox box;
    tile.getBoundingBox(box);
    appendTile(toCoord(box.min()), box.dim().x(), double(*tile), sources);
  }
  if (sources.size() != bricks) throw std::logic_error("a tree's survey and its reader disagree");
  return sources;
}

template <class Tree>
TreeVoxels readVoxelsAs(Archive& archive, const LocatedTree& located, GridClass gridClass,
                        const ReadOptions& options) {
  using Leaf = typename Tree::LeafNodeType;
  const std::uint64_t bricks = located.survey.leaves + located.survey.tileBricks;
  refuseTooLarge(bricks, located.survey.treeBytes, options);
  const auto tree = readTree<Tree>(archive, located);
  TreeVoxels result;
  result.background = double(tree.background());
  const FillRules rules{narrowBackground(result.background), gridClass == GridClass::kLevelSet,
                        options.nonFinite, options.allowEmpty};
  NonFiniteTally tally;
  result.volume = buildVolume<Leaf, LeafAccess<Leaf>>(brickSources(tree, bricks), rules, tally);
  result.nonFiniteReplaced = tally.count;
  return result;
}

}  // namespace

bool isScalarFloatTree(const ArchiveEntry& entry) {
  return entry.treeType == openvdb::FloatTree::treeType() ||
         entry.treeType == openvdb::DoubleTree::treeType();
}

TreeSurvey surveyTree(Archive& archive, const ArchiveEntry& entry) {
  return locateTree(archive, entry).survey;
}

TreeVoxels readVoxels(Archive& archive, const ArchiveEntry& entry, GridClass gridClass,
                      const ReadOptions& options) {
  const LocatedTree located = locateTree(archive, entry);
  return entry.treeType == openvdb::DoubleTree::treeType()
             ? readVoxelsAs<openvdb::DoubleTree>(archive, located, gridClass, options)
             : readVoxelsAs<openvdb::FloatTree>(archive, located, gridClass, options);
}

}  // namespace esvr::vdb
