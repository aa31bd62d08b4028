#include "vdb/tree_reader.h"

#include "vdb/versions.h"

#include "vdb/integer_trees.h"
#include "vdb/scalar_trees.h"
#include "vdb/vector_trees.h"

#include <openvdb/io/Compression.h>
#include <openvdb/io/io.h>

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

ValueLayout layoutOf(const ArchiveEntry& owner, const GridHead& head) {
  const std::string type = owner.valueType();
  const bool isDouble = type == "double" || type == "vec3d" || type == "int64";
  const bool isBool = type == "bool";
  const std::uint64_t numbers = isVectorTree(owner) ? kComponents : 1;
  const std::uint64_t bytes = isDouble ? sizeof(double) : isBool ? sizeof(bool) : sizeof(float);
  return {numbers * bytes, numbers * sizeof(openvdb::math::half), owner.savedAsHalf,
          head.compression, isBool};
}

LocatedTree locateTree(Archive& archive, const ArchiveEntry& entry) {
  const ArchiveEntry& owner = archive.treeOwner(entry);
  if (owner.treeType != entry.treeType)
    throw BadInput("is damaged: it shares the voxels of a grid of another type");
  GridHead head = archive.readHead(owner);
  const ValueLayout layout = layoutOf(owner, head);
  const TreeSurvey survey = surveyTree(archive.file(), layout);
  return {owner, std::move(head), layout, survey};
}

openvdb::Coord openVdbCoord(Coord c) { return {c.x, c.y, c.z}; }

/// Notes the leaves and the active tiles of a tree.
template <class Value>
class TopologyReader {
 public:
  TopologyReader(InputFile& file, bool savedAsHalf, std::size_t component)
      : file_(file), savedAsHalf_(savedAsHalf), component_(component) {}

  void leaf(Coord corner, const LeafMask& mask) {
    leaves.push_back(corner);
    if (mask.count() > 0) bricks.push_back(corner);
  }

  void rootTile(Coord corner, std::uint64_t at) {
    const std::uint64_t back = file_.position();
    file_.seek(at);
    Value value;
    file_.read(&value, sizeof value);
    tile({corner, kUpperExtent, numberOf(value)});
    file_.seek(back);
  }

  template <int kLog2>
  void tiles(const NodeMask<kLog2>& mask, const TileValues& place, std::int32_t extent) {
    using OpenVdbMask = openvdb::util::NodeMask<kLog2>;
    OpenVdbMask active;
    for (openvdb::Index w = 0; w < mask.words.size(); ++w)
      active.template getWord<openvdb::Index64>(w) = mask.words[w];
    std::vector<Value> values(OpenVdbMask::SIZE);
    file_.seek(place.at);
    openvdb::io::readCompressedValues(file_.stream(), values.data(), OpenVdbMask::SIZE, active,
                                      savedAsHalf_);
    file_.followStream();
    mask.forEachSet([&](std::size_t n) {
      tile({cellCorner<kLog2>(place.corner, n, extent), extent, numberOf(values[n])});
    });
  }

  std::vector<Coord> leaves;  ///< in the file's order
  std::vector<Coord> bricks;  ///< corners of all bricks with an active voxel
  std::vector<TileSource> activeTiles;

 private:
  [[nodiscard]] double numberOf(const Value& value) const {
    return double(componentOf(value, component_));
  }

  void tile(const TileSource& tile) {
    activeTiles.push_back(tile);
    appendBricks(tile, bricks);
  }

  InputFile& file_;
  bool savedAsHalf_;
  std::size_t component_;
};

/// Reads the voxels of a tree leaf by leaf. There is no tree of OpenVDB in memory.
template <class Tree>
class VoxelReader {
 public:
  VoxelReader(Archive& archive, const LocatedTree& located, std::size_t component)
      : file_(archive.file()),
        located_(located),
        topology_(file_, located.owner.savedAsHalf, component),
        component_(component) {
    openvdb::io::setDataCompression(file_.stream(), located.head.compression);
    file_.seek(located.head.treeAt + sizeof(std::int32_t));
    file_.read(&background_, sizeof background_);
    openvdb::io::setGridBackgroundValuePtr(file_.stream(), &background_);
  }
  ~VoxelReader() { openvdb::io::setGridBackgroundValuePtr(file_.stream(), nullptr); }
  VoxelReader(const VoxelReader&) = delete;
  VoxelReader& operator=(const VoxelReader&) = delete;

  [[nodiscard]] double background() const { return double(componentOf(background_, component_)); }

  SparseVolume read(const FillRules& rules, const VoxelMemory& memory, NonFiniteTally& tally) {
    file_.seek(located_.head.treeAt);
    topology_.leaves.reserve(located_.survey.leaves);
    topology_.bricks.reserve(located_.survey.leaves + located_.survey.tileBricks);
    TreeWalk(file_, located_.layout, topology_).topology();
    SparseVolume volume = layOutBricks(topology_.bricks, rules, memory);
    topology_.bricks = {};
    file_.seek(file_.position());  // OpenVDB reads on from there
    for (const Coord corner : topology_.leaves) readLeaf(corner, rules, volume, tally);
    for (const TileSource& tile : topology_.activeTiles) fillTile(tile, volume, tally);
    return volume;
  }

 private:
  using Leaf = typename Tree::LeafNodeType;
  using Value = typename Tree::ValueType;

  void readLeaf(Coord corner, const FillRules& rules, SparseVolume& volume, NonFiniteTally& tally) {
    Leaf leaf(openvdb::PartialCreate{}, openVdbCoord(corner), background_);
    leaf.readBuffers(file_.stream(), located_.owner.savedAsHalf);
    const auto b = findBrick(volume, brickOf(corner) - brickOf(volume.origin));
    if (b.has_value() == leaf.valueMask().isOff())
      throw BadInput("is damaged: a leaf has two different masks");
    if (b) fillFromLeaf(leaf, LeafAccess<Leaf>{component_}, rules, *b, volume, tally);
  }

  InputFile& file_;
  const LocatedTree& located_;
  TopologyReader<Value> topology_;
  std::size_t component_;
  Value background_{};
};

/// The leaves and the active tiles of a tree of integers.
template <class Value>
class IntegerTopology {
 public:
  struct Tile {
    TileSource place;
    Value value;
  };

  explicit IntegerTopology(InputFile& file) : file_(file) {}

  void leaf(Coord corner, const LeafMask&) { leaves.push_back(corner); }

  void rootTile(Coord corner, std::uint64_t at) {
    const std::uint64_t back = file_.position();
    file_.seek(at);
    Stored value{};
    file_.read(&value, sizeof value);
    activeTiles.push_back({{corner, kUpperExtent}, Value(value)});
    file_.seek(back);
  }

  template <int kLog2>
  void tiles(const NodeMask<kLog2>& mask, const TileValues& place, std::int32_t extent) {
    using OpenVdbMask = openvdb::util::NodeMask<kLog2>;
    OpenVdbMask active;
    for (openvdb::Index w = 0; w < mask.words.size(); ++w)
      active.template getWord<openvdb::Index64>(w) = mask.words[w];
    const auto values = std::make_unique<Value[]>(OpenVdbMask::SIZE);
    file_.seek(place.at);
    openvdb::io::readCompressedValues(file_.stream(), values.get(), OpenVdbMask::SIZE, active,
                                      /*fromHalf=*/false);
    file_.followStream();
    mask.forEachSet([&](std::size_t n) {
      activeTiles.push_back({{cellCorner<kLog2>(place.corner, n, extent), extent}, values[n]});
    });
  }

  std::vector<Coord> leaves;  ///< in the file's order
  std::vector<Tile> activeTiles;

 private:
  // A byte of a damaged file may be no truth value.
  using Stored = std::conditional_t<std::is_same_v<Value, bool>, std::uint8_t, Value>;

  InputFile& file_;
};

/// Reads the bricks of a tree of integers.
template <class Tree>
class IntegerReader {
 public:
  using Value = typename Tree::ValueType;

  IntegerReader(InputFile& file, const LocatedTree& located) : file_(file), located_(located) {}

  PackedVoxels<Value> read() {
    openvdb::io::setDataCompression(file_.stream(), located_.head.compression);
    file_.seek(located_.head.treeAt + sizeof(std::int32_t));
    Value background{};
    file_.read(&background, sizeof background);
    made_.background = background;
    openvdb::io::setGridBackgroundValuePtr(file_.stream(), &background);
    file_.seek(located_.head.treeAt);
    IntegerTopology<Value> topology(file_);
    TreeWalk(file_, located_.layout, topology).topology();
    file_.seek(file_.position());  // OpenVDB reads on from there
    for (const Coord corner : topology.leaves) leaf(corner, background);
    openvdb::io::setGridBackgroundValuePtr(file_.stream(), nullptr);
    for (const auto& tile : topology.activeTiles) addTile(tile.place, tile.value);
    std::ranges::sort(made_.bricks, {}, &PackedBrick::corner);
    if (std::ranges::adjacent_find(made_.bricks, {}, &PackedBrick::corner) != made_.bricks.end())
      throw BadInput("is damaged: two parts of the tree have the same voxels");
    return std::move(made_);
  }

 private:
  using Leaf = typename Tree::LeafNodeType;

  void leaf(Coord corner, const Value& background) {
    Leaf leaf(openvdb::PartialCreate{}, openVdbCoord(corner), background);
    leaf.readBuffers(file_.stream());
    BrickMask mask = LeafAccess<Leaf>{}.mask(leaf);
    if constexpr (std::is_same_v<Value, bool>)
      for (int i = 0; i < kBrickVoxels; ++i)
        if (!leaf.getValue(openvdb::Index(i)))
          mask.words[std::size_t(i >> 6)] &= ~(std::uint64_t{1} << (i & 63));
    append(corner, mask, [&](int i) { return leaf.getValue(openvdb::Index(i)); });
  }

  void addTile(const TileSource& tile, Value value) {
    if (std::is_same_v<Value, bool> && !value) return;
    std::vector<Coord> corners;
    appendBricks(tile, corners);
    BrickMask all;
    all.setAll();
    for (const Coord corner : corners) append(corner, all, [&](int) { return value; });
  }

  template <class ValueAt>
  void append(Coord corner, const BrickMask& mask, const ValueAt& valueAt) {
    if (mask == BrickMask{}) return;
    if (made_.parts.empty()) made_.parts.emplace_back();
    auto& values = made_.parts.front();
    made_.bricks.push_back({corner, mask, 0, values.size()});
    if constexpr (!std::is_same_v<Value, bool>)
      for (int i = 0; i < kBrickVoxels; ++i)
        if (mask.test(i)) values.push_back(valueAt(i));
  }

  InputFile& file_;
  const LocatedTree& located_;
  PackedVoxels<Value> made_;
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
                        options.allowEmpty};
  NonFiniteTally tally;
  result.volume = reader.read(rules, options.memory, tally);
  refuseNonFinite(tally, rules.nonFinite);
  result.nonFiniteReplaced = tally.count;
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

bool isIntegerTree(const ArchiveEntry& entry) {
  return entry.treeType == openvdb::Int32Tree::treeType() ||
         entry.treeType == openvdb::Int64Tree::treeType() ||
         entry.treeType == openvdb::BoolTree::treeType();
}

AnyPackedVoxels readIntegers(Archive& archive, const ArchiveEntry& entry,
                             const ReadOptions& options) {
  const LocatedTree located = locateTree(archive, entry);
  refuseTooLarge(located.survey.leaves + located.survey.tileBricks, options);
  if (entry.treeType == openvdb::Int32Tree::treeType())
    return IntegerReader<openvdb::Int32Tree>(archive.file(), located).read();
  if (entry.treeType == openvdb::Int64Tree::treeType())
    return IntegerReader<openvdb::Int64Tree>(archive.file(), located).read();
  return IntegerReader<openvdb::BoolTree>(archive.file(), located).read();
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
