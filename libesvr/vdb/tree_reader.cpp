#include "vdb/tree_reader.h"

#include "vdb/versions.h"

#include "vdb/scalar_trees.h"

#include <stdexcept>

#include "esvr/error.h"
#include "vdb/brick_filler.h"

namespace esvr::vdb {
namespace {

/// Access to the leaves of OpenVDB. Their voxels are in voxelOffset order.
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

/// Reads a tree without the voxels of its leaves, which follow it in the file.
template <class Tree>
void readTopology(Archive& archive, const LocatedTree& located, Tree& tree) {
  InputFile& file = archive.file();
  file.seek(located.head.treeAt);
  openvdb::io::setDataCompression(file.stream(), located.head.compression);
  tree.readTopology(file.stream(), located.owner.savedAsHalf);
}

/// Calls `use` for each leaf, in the file's order, while the leaf has its voxels.
template <class Tree, class Use>
void readLeaves(Archive& archive, const LocatedTree& located, Tree& tree, const Use& use) {
  using Buffer = typename Tree::LeafNodeType::Buffer;
  for (auto leaf = tree.beginLeaf(); leaf; ++leaf) {
    const auto mask = leaf->valueMask();
    leaf->readBuffers(archive.file().stream(), located.owner.savedAsHalf);
    if (leaf->valueMask() != mask) throw BadInput("is damaged: a leaf has two different masks");
    use(*leaf);
    Buffer empty(openvdb::PartialCreate{}, tree.background());
    leaf->swap(empty);
  }
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
  Tree tree;
  readTopology(archive, located, tree);
  TreeVoxels result;
  result.background = double(tree.background());
  const FillRules rules{narrowBackground(result.background), gridClass == GridClass::kLevelSet,
                        options.nonFinite, options.allowEmpty};
  NonFiniteTally tally;
  {
    auto sources = brickSources(tree, bricks);
    result.volume = volumeFor<Leaf, LeafAccess<Leaf>>(sources, rules, options.memory, tally);
  }
  SparseVolume& volume = result.volume;
  readLeaves(archive, located, tree, [&](const Leaf& leaf) {
    const Coord corner = toCoord(leaf.origin());
    if (const auto b = findBrick(volume, brickOf(corner) - brickOf(volume.origin)))
      fillFromLeaf<Leaf, LeafAccess<Leaf>>(leaf, rules, corner, volume.brickValues(*b),
                                           volume.active[*b], tally);
  });
  refuseNonFinite(tally, rules.nonFinite);
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
