#include "vdb/tree_reader.h"

#include "vdb/versions.h"

#include "vdb/trees.h"

#include <openvdb/io/Compression.h>
#include <openvdb/io/io.h>

#include <algorithm>
#include <memory>
#include <span>
#include <type_traits>

#include "core/parallel.h"
#include "esvr/error.h"
#include "esvr/memory_limit.h"
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

/// A value at the position of the file. A byte of a damaged file may be no truth value.
template <class Value>
Value storedValue(InputFile& file) {
  if constexpr (std::is_same_v<Value, bool>)
    return file.read<std::uint8_t>() != 0;
  else
    return file.read<Value>();
}

/// A visitor of a TreeWalk that reads the values of tiles.
/// \tparam Sink  has the functions leaf(corner, mask), and tile(corner, extent, value, isActive) for tiles
///               that are active or differ from the background
template <class Value, class Sink>
class TopologyReader {
 public:
  TopologyReader(InputFile& file, bool savedAsHalf, Sink& sink)
      : file_(file), savedAsHalf_(savedAsHalf), sink_(sink) {}

  void leaf(Coord corner, const LeafMask& mask) { sink_.leaf(corner, mask); }

  void rootTile(Coord corner, std::uint64_t at, bool isActive) {
    const std::uint64_t back = file_.position();
    file_.seek(at);
    sink_.tile(corner, kUpperExtent, storedValue<Value>(file_), isActive);
    file_.seek(back);
  }

  template <int kLog2>
  void tiles(const NodeCells<NodeMask<kLog2>>& cells, std::int32_t extent) {
    if (cells.onlyBackground && cells.active.count() == 0) return;
    using OpenVdbMask = openvdb::util::NodeMask<kLog2>;
    OpenVdbMask active;
    for (openvdb::Index w = 0; w < cells.active.words.size(); ++w)
      active.template getWord<openvdb::Index64>(w) = cells.active.words[w];
    const auto values = std::make_unique<Value[]>(OpenVdbMask::SIZE);
    file_.seek(cells.at);
    openvdb::io::readCompressedValues(file_.stream(), values.get(), OpenVdbMask::SIZE, active,
                                      savedAsHalf_);
    file_.followStream();
    for (std::size_t n = 0; n < OpenVdbMask::SIZE; ++n)
      if (!cells.children.test(n))
        sink_.tile(cellCorner<kLog2>(cells.corner, n, extent), extent, values[n],
                   cells.active.test(n));
  }

 private:
  InputFile& file_;
  bool savedAsHalf_;
  Sink& sink_;
};

/// A tree whose leaves are read one after the other. There is no tree of OpenVDB in memory.
template <class Tree>
class LeafReader {
 public:
  using Leaf = typename Tree::LeafNodeType;
  using Value = typename Tree::ValueType;

  LeafReader(Archive& archive, const LocatedTree& located)
      : file_(archive.file()), located_(located) {
    openvdb::io::setDataCompression(file_.stream(), located.head.compression);
    file_.seek(located.head.treeAt + sizeof(std::int32_t));
    background_ = storedValue<Value>(file_);
    openvdb::io::setGridBackgroundValuePtr(file_.stream(), &background_);
  }
  ~LeafReader() { openvdb::io::setGridBackgroundValuePtr(file_.stream(), nullptr); }
  LeafReader(const LeafReader&) = delete;
  LeafReader& operator=(const LeafReader&) = delete;

  [[nodiscard]] const Value& background() const { return background_; }
  [[nodiscard]] const TreeSurvey& survey() const { return located_.survey; }

  /// Gives the leaves and the tiles to a sink of a TopologyReader.
  template <class Sink>
  void topology(Sink& sink) {
    file_.seek(located_.head.treeAt);
    TopologyReader<Value, Sink> reader(file_, located_.owner.savedAsHalf, sink);
    TreeWalk(file_, located_.layout, reader).topology();
    file_.seek(file_.position());  // OpenVDB reads on from there
  }

  /// Calls visit(corner, leaf) for leaves with their values.
  /// \param corners  of all leaves in the file's order
  template <class Visit>
  void leaves(std::span<const Coord> corners, const Visit& visit) {
    for (const Coord corner : corners) {
      throwIfCancelled();
      Leaf leaf(openvdb::PartialCreate{}, openVdbCoord(corner), background_);
      leaf.readBuffers(file_.stream(), located_.owner.savedAsHalf);
      visit(corner, leaf);
    }
  }

 private:
  InputFile& file_;
  const LocatedTree& located_;
  Value background_{};
};

[[noreturn]] void refuseTwoMasks() { throw BadInput("is damaged: a leaf has two different masks"); }

/// The places of the leaves and the active tiles of a tree of numbers, or of a component. Inactive tiles
/// are counted.
template <class Value>
struct VolumeTopology {
  std::size_t component;
  InactiveCounter& inactive;
  std::vector<Coord> leaves{};  ///< They have the file's order.
  std::vector<Coord> bricks{};  ///< corners of all bricks with an active voxel
  std::vector<TileSource> activeTiles{};

  void leaf(Coord corner, const LeafMask& mask) {
    leaves.push_back(corner);
    if (mask.count() > 0) bricks.push_back(corner);
  }
  void tile(Coord corner, std::int32_t extent, const Value& value, bool isActive) {
    const TileSource tile{corner, extent, double(componentOf(value, component))};
    if (!isActive) return inactive.tile(tile);
    activeTiles.push_back(tile);
    appendBricks(tile, bricks);
  }
};

template <class Tree>
SparseVolume readVolume(LeafReader<Tree>& reader, std::size_t component, const FillRules& rules,
                        const VoxelMemory& memory, FillTallies& tallies) {
  using Leaf = typename Tree::LeafNodeType;
  VolumeTopology<typename Tree::ValueType> topology{component, tallies.inactive};
  topology.leaves.reserve(reader.survey().leaves);
  topology.bricks.reserve(reader.survey().leaves + reader.survey().tileBricks);
  reader.topology(topology);
  SparseVolume volume = layOutBricks(topology.bricks, rules, memory);
  topology.bricks = {};
  const LeafAccess<Leaf> access{component};
  reader.leaves(topology.leaves, [&](Coord corner, const Leaf& leaf) {
    const auto b = findBrick(volume, brickOf(corner) - brickOf(volume.origin));
    if (b.has_value() == leaf.valueMask().isOff()) refuseTwoMasks();
    if (b)
      fillFromLeaf(leaf, access, rules, *b, volume, tallies);
    else
      countInactiveLeaf(leaf, access, rules, corner, tallies);
  });
  for (const TileSource& tile : topology.activeTiles) {
    throwIfCancelled();
    fillTile(tile, volume, tallies.nonFinite);
  }
  return volume;
}

template <class Tree>
TreeVoxels readVoxelsAs(Archive& archive, const LocatedTree& located, const WantedVoxels& wanted,
                        const ReadOptions& options) {
  refuseTooLarge(located.survey.leaves + located.survey.tileBricks, options);
  LeafReader<Tree> reader(archive, located);
  TreeVoxels result;
  result.background = double(componentOf(reader.background(), wanted.component));
  const FillRules rules{narrowBackground(result.background),
                        wanted.gridClass == GridClass::kLevelSet, options.nonFinite,
                        options.nonFiniteValue, options.allowEmpty};
  FillTallies tallies{{.replacement = rules.replacement()},
                      InactiveCounter(result.background, rules.levelSet)};
  result.volume = readVolume(reader, wanted.component, rules, options.memory, tallies);
  refuseNonFinite(tallies.nonFinite, rules.nonFinite);
  result.nonFiniteReplaced = tallies.nonFinite.count;
  result.inactive = tallies.inactive.lostIn(result.volume);
  return result;
}

/// A value in the type that PackedVoxels has for it.
template <class T, class Value>
T packedValue(const Value& value) {
  if constexpr (std::is_same_v<T, PackedVector>)
    return {float(value[0]), float(value[1]), float(value[2])};
  else
    return T(value);
}

/// Collects the bricks of a tree with their values.
template <class T, class Value>
class BrickPacker {
 public:
  BrickPacker(const Value& background, const TreeSurvey& survey) {
    made_.background = packedValue<T>(background);
    made_.bricks.reserve(survey.leaves + survey.tileBricks);
    made_.parts.emplace_back();
    if constexpr (!std::is_same_v<T, bool>) made_.parts.front().reserve(survey.activeVoxels);
    leaves.reserve(survey.leaves);
  }

  // For a TopologyReader.
  void leaf(Coord corner, const LeafMask&) { leaves.push_back(corner); }
  void tile(Coord corner, std::int32_t extent, const Value& value, bool isActive) {
    if (!isActive || isFalse(value)) return;
    std::vector<Coord> corners;
    appendBricks({corner, extent}, corners);
    BrickMask all;
    all.setAll();
    for (const Coord brick : corners) {
      throwIfCancelled();
      append(brick, all, [&](int) { return value; });
    }
  }

  /// \param mask  the active voxels. \param valueAt  gives the value at an offset in the brick
  template <class ValueAt>
  void append(Coord corner, BrickMask mask, const ValueAt& valueAt) {
    if constexpr (std::is_same_v<T, bool>)
      for (int i = 0; i < kBrickVoxels; ++i)
        if (!valueAt(i)) mask.words[std::size_t(i >> 6)] &= ~(std::uint64_t{1} << (i & 63));
    if (mask == BrickMask{}) return;
    auto& values = made_.parts.front();
    made_.bricks.push_back({corner, mask, 0, values.size()});
    if constexpr (!std::is_same_v<T, bool>)
      forEachActive(mask, [&](int i) { values.push_back(packedValue<T>(valueAt(i))); });
  }

  PackedVoxels<T> finish() {
    std::ranges::sort(made_.bricks, {}, &PackedBrick::corner);
    if (std::ranges::adjacent_find(made_.bricks, {}, &PackedBrick::corner) != made_.bricks.end())
      throw BadInput("is damaged: two parts of the tree have the same voxels");
    return std::move(made_);
  }

  std::vector<Coord> leaves;  ///< corners, in the file's order

 private:
  static bool isFalse(const Value& value) {
    if constexpr (std::is_same_v<T, bool>)
      return !value;
    else
      return false;
  }

  PackedVoxels<T> made_;
};

template <class T, class Tree>
PackedVoxels<T> readPackedAs(Archive& archive, const LocatedTree& located,
                             const ReadOptions& options) {
  using Leaf = typename Tree::LeafNodeType;
  const TreeSurvey& survey = located.survey;
  requireWithinMemory(double(survey.leaves + survey.tileBricks) * double(kBytesPerPackedBrick) +
                          double(survey.activeVoxels) * double(sizeof(T)),
                      options.maxBytes, "the grid");
  LeafReader<Tree> reader(archive, located);
  BrickPacker<T, typename Tree::ValueType> packer(reader.background(), survey);
  reader.topology(packer);
  reader.leaves(packer.leaves, [&](Coord corner, const Leaf& leaf) {
    packer.append(corner, LeafAccess<Leaf>{}.mask(leaf),
                  [&](int i) { return leaf.getValue(openvdb::Index(i)); });
  });
  return packer.finish();
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

bool isPackedTree(const ArchiveEntry& entry) {
  return isScalarFloatTree(entry) || isVectorTree(entry) ||
         entry.treeType == openvdb::Int32Tree::treeType() ||
         entry.treeType == openvdb::Int64Tree::treeType() ||
         entry.treeType == openvdb::BoolTree::treeType();
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

AnyPackedVoxels readPackedVoxels(Archive& archive, const ArchiveEntry& entry,
                                 const ReadOptions& options) {
  const LocatedTree located = locateTree(archive, entry);
  const auto is = [&](const openvdb::Name& type) { return entry.treeType == type; };
  if (is(openvdb::DoubleTree::treeType()))
    return readPackedAs<double, openvdb::DoubleTree>(archive, located, options);
  if (is(openvdb::Int32Tree::treeType()))
    return readPackedAs<std::int32_t, openvdb::Int32Tree>(archive, located, options);
  if (is(openvdb::Int64Tree::treeType()))
    return readPackedAs<std::int64_t, openvdb::Int64Tree>(archive, located, options);
  if (is(openvdb::BoolTree::treeType()))
    return readPackedAs<bool, openvdb::BoolTree>(archive, located, options);
  if (is(openvdb::Vec3STree::treeType()))
    return readPackedAs<PackedVector, openvdb::Vec3STree>(archive, located, options);
  if (is(openvdb::Vec3DTree::treeType()))
    return readPackedAs<PackedVector, openvdb::Vec3DTree>(archive, located, options);
  return readPackedAs<float, openvdb::FloatTree>(archive, located, options);
}

}  // namespace esvr::vdb
