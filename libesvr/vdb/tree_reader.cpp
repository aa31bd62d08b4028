#include "vdb/tree_reader.h"

#include "vdb/versions.h"

#include "vdb/scalar_trees.h"
#include "vdb/vector_trees.h"

#include <openvdb/io/Compression.h>
#include <openvdb/io/io.h>

#include "core/parallel.h"
#include "esvr/error.h"
#include "vdb/brick_filler.h"
#include "vdb/tree_walk.h"

namespace esvr::vdb {
namespace {

/// A component of a value; of a number, itself.
template <class Value>
auto componentOf(const Value& value, std::size_t component) {
  if constexpr (openvdb::VecTraits<Value>::IsVec)
    return value[int(component)];
  else
    return value;
}

/// Access to a component of the leaves of OpenVDB. Their voxels are in voxelOffset order.
template <class Leaf>
struct LeafAccess {
  std::size_t component = 0;

  auto value(const Leaf& leaf, int i) const {
    return componentOf(leaf.buffer().data()[i], component);
  }
  BrickMask mask(const Leaf& leaf) const {
    BrickMask mask;
    for (openvdb::Index w = 0; w < mask.words.size(); ++w)
      mask.words[w] = leaf.valueMask().template getWord<openvdb::Index64>(w);
    return mask;
  }
};

/// The position and the head of an entry's tree.
struct LocatedTree {
  const ArchiveEntry& owner;
  GridHead head;
  ValueLayout layout;
  TreeSurvey survey;
};

LocatedTree locateTree(Archive& archive, const ArchiveEntry& entry) {
  const ArchiveEntry& owner = archive.treeOwner(entry);
  if (owner.treeType != entry.treeType)
    throw BadInput("is damaged: it shares the voxels of a grid of another type");
  GridHead head = archive.readHead(owner);
  const ValueLayout layout =
      layoutOf({owner.treeType, owner.savedAsHalf, head.compression}).value();
  const InputFile::Within grid(archive.file(), owner.gridAt + owner.gridBytes);
  const TreeSurvey survey = surveyTree(archive.file(), layout);
  return {owner, std::move(head), layout, survey};
}

openvdb::Coord openVdbCoord(Coord c) { return {c.x, c.y, c.z}; }

/// Notes the leaves and the active tiles of a tree, and counts the inactive tiles.
template <class Value>
class TopologyReader {
 public:
  TopologyReader(InputFile& file, bool savedAsHalf, std::size_t component,
                 InactiveCounter& inactive)
      : file_(file), savedAsHalf_(savedAsHalf), component_(component), inactive_(inactive) {}

  void leaf(Coord corner, const LeafMask& mask) {
    leaves.push_back(corner);
    if (mask.count() > 0) bricks.push_back(corner);
  }

  void rootTile(Coord corner, std::uint64_t at, bool isActive) {
    const std::uint64_t back = file_.position();
    file_.seek(at);
    Value value;
    file_.read(&value, sizeof value);
    add({corner, kUpperExtent, numberOf(value)}, isActive);
    file_.seek(back);
  }

  template <int kLog2>
  void tiles(const NodeCells<NodeMask<kLog2>>& cells, std::int32_t extent) {
    if (cells.onlyBackground && cells.active.count() == 0) return;
    using OpenVdbMask = openvdb::util::NodeMask<kLog2>;
    OpenVdbMask active;
    for (openvdb::Index w = 0; w < cells.active.words.size(); ++w)
      active.template getWord<openvdb::Index64>(w) = cells.active.words[w];
    std::vector<Value> values(OpenVdbMask::SIZE);
    file_.seek(cells.at);
    openvdb::io::readCompressedValues(file_.stream(), values.data(), OpenVdbMask::SIZE, active,
                                      savedAsHalf_);
    file_.followStream();
    for (std::size_t n = 0; n < values.size(); ++n)
      if (!cells.children.test(n))
        add({cellCorner<kLog2>(cells.corner, n, extent), extent, numberOf(values[n])},
            cells.active.test(n));
  }

  std::vector<Coord> leaves;  ///< in the file's order
  std::vector<Coord> bricks;  ///< corners of all bricks with an active voxel
  std::vector<TileSource> activeTiles;

 private:
  [[nodiscard]] double numberOf(const Value& value) const {
    return double(componentOf(value, component_));
  }

  void add(const TileSource& tile, bool isActive) {
    if (!isActive) return inactive_.tile(tile);
    activeTiles.push_back(tile);
    appendBricks(tile, bricks);
  }

  InputFile& file_;
  bool savedAsHalf_;
  std::size_t component_;
  InactiveCounter& inactive_;
};

/// Reads the voxels of a tree leaf by leaf. There is no tree of OpenVDB in memory.
template <class Tree>
class VoxelReader {
 public:
  VoxelReader(Archive& archive, const LocatedTree& located, std::size_t component)
      : file_(archive.file()), located_(located), component_(component) {
    openvdb::io::setDataCompression(file_.stream(), located.head.compression);
    file_.seek(located.head.treeAt + sizeof(std::int32_t));
    file_.read(&background_, sizeof background_);
    openvdb::io::setGridBackgroundValuePtr(file_.stream(), &background_);
  }
  ~VoxelReader() { openvdb::io::setGridBackgroundValuePtr(file_.stream(), nullptr); }
  VoxelReader(const VoxelReader&) = delete;
  VoxelReader& operator=(const VoxelReader&) = delete;

  [[nodiscard]] double background() const { return double(componentOf(background_, component_)); }

  SparseVolume read(const FillRules& rules, const VoxelMemory& memory, FillTallies& tallies) {
    file_.seek(located_.head.treeAt);
    TopologyReader<Value> topology(file_, located_.owner.savedAsHalf, component_, tallies.inactive);
    topology.leaves.reserve(located_.survey.leaves);
    topology.bricks.reserve(located_.survey.leaves + located_.survey.tileBricks);
    TreeWalk(file_, located_.layout, topology).topology();
    SparseVolume volume = layOutBricks(topology.bricks, rules, memory);
    topology.bricks = {};
    file_.seek(file_.position());  // OpenVDB reads on from there
    for (const Coord corner : topology.leaves) {
      throwIfCancelled();
      readLeaf(corner, rules, volume, tallies);
    }
    for (const TileSource& tile : topology.activeTiles) {
      throwIfCancelled();
      fillTile(tile, volume, tallies.nonFinite);
    }
    return volume;
  }

 private:
  using Leaf = typename Tree::LeafNodeType;
  using Value = typename Tree::ValueType;

  void readLeaf(Coord corner, const FillRules& rules, SparseVolume& volume, FillTallies& tallies) {
    Leaf leaf(openvdb::PartialCreate{}, openVdbCoord(corner), background_);
    leaf.readBuffers(file_.stream(), located_.owner.savedAsHalf);
    const auto b = findBrick(volume, brickOf(corner) - brickOf(volume.origin));
    if (b.has_value() == leaf.valueMask().isOff())
      throw BadInput("is damaged: a leaf has two different masks");
    const LeafAccess<Leaf> access{component_};
    if (b)
      fillFromLeaf(leaf, access, rules, *b, volume, tallies);
    else
      countInactiveLeaf(leaf, access, rules, corner, tallies);
  }

  InputFile& file_;
  const LocatedTree& located_;
  std::size_t component_;
  Value background_{};
};

template <class Tree>
TreeVoxels readVoxelsAs(Archive& archive, const LocatedTree& located, const WantedVoxels& wanted,
                        const ReadOptions& options) {
  refuseTooLarge(located.survey.leaves + located.survey.tileBricks, options);
  VoxelReader<Tree> reader(archive, located, wanted.component);
  TreeVoxels result;
  result.background = reader.background();
  const FillRules rules{narrowBackground(result.background),
                        wanted.gridClass == GridClass::kLevelSet, options.nonFinite,
                        options.nonFiniteValue, options.allowEmpty};
  FillTallies tallies{{.replacement = rules.replacement()},
                      InactiveCounter(result.background, rules.levelSet)};
  result.volume = reader.read(rules, options.memory, tallies);
  refuseNonFinite(tallies.nonFinite, rules.nonFinite);
  result.nonFiniteReplaced = tallies.nonFinite.count;
  result.inactive = tallies.inactive.lostIn(result.volume);
  return result;
}

}  // namespace

bool isScalarFloatTree(const ArchiveEntry& entry) {
  return entry.treeType == openvdb::FloatTree::treeType() ||
         entry.treeType == openvdb::DoubleTree::treeType();
}

bool isVectorTree(const ArchiveEntry& entry) {
  return entry.treeType == openvdb::Vec3STree::treeType() ||
         entry.treeType == openvdb::Vec3DTree::treeType();
}

TreeSurvey surveyTree(Archive& archive, const ArchiveEntry& entry) {
  return locateTree(archive, entry).survey;
}

TreeVoxels readVoxels(Archive& archive, const ArchiveEntry& entry, const WantedVoxels& wanted,
                      const ReadOptions& options) {
  const LocatedTree located = locateTree(archive, entry);
  const auto is = [&](const openvdb::Name& type) { return entry.treeType == type; };
  if (is(openvdb::DoubleTree::treeType()))
    return readVoxelsAs<openvdb::DoubleTree>(archive, located, wanted, options);
  if (is(openvdb::Vec3STree::treeType()))
    return readVoxelsAs<openvdb::Vec3STree>(archive, located, wanted, options);
  if (is(openvdb::Vec3DTree::treeType()))
    return readVoxelsAs<openvdb::Vec3DTree>(archive, located, wanted, options);
  return readVoxelsAs<openvdb::FloatTree>(archive, located, wanted, options);
}

}  // namespace esvr::vdb
