#include "vdb/formats.h"

#include "vdb/open_vdb.h"

#include <openvdb/io/Compression.h>
#include <openvdb/io/io.h>

#include <algorithm>
#include <map>
#include <memory>
#include <span>
#include <type_traits>

#include "core/memory_budget.h"
#include "core/parallel.h"
#include "esvr/device.h"
#include "esvr/error.h"
#include "esvr/grid.h"
#include "vdb/archive.h"
#include "vdb/brick_filler.h"
#include "vdb/properties.h"
#include "vdb/tree_walk.h"

// Reads the grids of .vdb archives. Trees are surveyed first, so that every size is checked. OpenVDB then
// reads one leaf after the other; a tree of OpenVDB is never in memory. On top of that come the properties of
// a grid, and the functions that read grids from a file or from carried bytes.

namespace esvr::vdb {
namespace {

using openvdb::GridBase;

// Trees and their leaves

/// A component of a value; of a number, itself, and of a half its float.
template <class Value>
auto componentOf(const Value& value, std::size_t component) {
  if constexpr (openvdb::VecTraits<Value>::IsVec)
    return value[int(component)];
  else if constexpr (std::is_same_v<Value, openvdb::math::half>)
    return float(value);
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

bool isHalfTree(const ArchiveEntry& entry) { return entry.treeType == HalfTree::treeType(); }

bool isScalarFloatTree(const ArchiveEntry& entry) {
  return entry.treeType == openvdb::FloatTree::treeType() ||
         entry.treeType == openvdb::DoubleTree::treeType() || isHalfTree(entry);
}

bool isVectorTree(const ArchiveEntry& entry) {
  return entry.treeType == openvdb::Vec3STree::treeType() ||
         entry.treeType == openvdb::Vec3DTree::treeType();
}

/// True if the tree can be read as packed voxels.
bool isPackedTree(const ArchiveEntry& entry) {
  return isScalarFloatTree(entry) || isVectorTree(entry) ||
         entry.treeType == openvdb::Int32Tree::treeType() ||
         entry.treeType == openvdb::Int64Tree::treeType() ||
         entry.treeType == openvdb::BoolTree::treeType();
}

/// A tree of a type that is read here, and where it is.
struct LocatedTree {
  const ArchiveEntry& owner;
  GridHead head;
  ValueLayout layout;
  TreeSurvey survey;
};

/// Finds and surveys the tree of an entry. \throws BadInput  it is truncated or damaged
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
      Leaf leaf(openvdb::PartialCreate{}, {corner.x, corner.y, corner.z}, background_);
      leaf.readBuffers(file_.stream(), located_.owner.savedAsHalf);
      visit(corner, leaf);
    }
  }

 private:
  InputFile& file_;
  const LocatedTree& located_;
  Value background_{};
};

// Voxels as volumes

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
    const auto b = brickWith(volume, corner);
    if (b.has_value() == leaf.valueMask().isOff())
      throw BadInput("is damaged: a leaf has two different masks");
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

/// Adds the voxels and the background to a grid.
/// \param component  of vectors; 0 for other values
template <class Tree>
void readVoxelsAs(Archive& archive, const LocatedTree& located, std::size_t component,
                  const ReadOptions& options, VolumeGrid& grid) {
  refuseTooLarge(located.survey.leaves + located.survey.tileBricks, options);
  LeafReader<Tree> reader(archive, located);
  const auto background = double(componentOf(reader.background(), component));
  const FillRules rules{narrowBackground(background),
                        grid.descriptor.gridClass == GridClass::kLevelSet, options.nonFinite,
                        options.nonFiniteValue, options.allowEmpty};
  FillTallies tallies{rules.tally(), InactiveCounter(background, rules.levelSet)};
  grid.volume = readVolume(reader, component, rules, options.memory, tallies);
  refuseNonFinite(tallies.nonFinite, rules.nonFinite);
  grid.descriptor.background = background;
  grid.nonFiniteReplaced = tallies.nonFinite.count;
  grid.narrowing = tallies.nonFinite.narrowing;
  grid.inactive = tallies.inactive.lostIn(grid.volume);
}

// Voxels as packed voxels

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

/// Reads the active voxels of an entry for which isPackedTree is true. Doubles of vectors are rounded to
/// floats; all other values are those of the file, also if they are not finite. Of a mask, the true
/// voxels among the active ones are read.
AnyPackedVoxels readPackedVoxels(Archive& archive, const ArchiveEntry& entry,
                                 const ReadOptions& options) {
  const LocatedTree located = locateTree(archive, entry);
  const auto is = [&](const openvdb::Name& type) { return entry.treeType == type; };
  if (is(openvdb::DoubleTree::treeType()))
    return readPackedAs<double, openvdb::DoubleTree>(archive, located, options);
  if (isHalfTree(entry)) return readPackedAs<float, HalfTree>(archive, located, options);
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

// The properties of grids

/// A grid of an archive and what is known of it before its voxels are read.
struct ListedGrid {
  std::size_t place = 0;
  GridHead head;
  GridSummary summary;
};

/// What trees hold, by their owners' positions. A tree that many grids share is surveyed once.
using Surveys = std::map<std::uint64_t, TreeSurvey>;

/// The class by OpenVDB's name for it, for example "level set"; kUnknown for any other text.
GridClass gridClassOf(const std::string& text) {
  switch (GridBase::stringToGridClass(text)) {
    case openvdb::GRID_LEVEL_SET:
      return GridClass::kLevelSet;
    case openvdb::GRID_FOG_VOLUME:
      return GridClass::kFogVolume;
    case openvdb::GRID_STAGGERED:
      return GridClass::kStaggered;
    default:
      return GridClass::kUnknown;
  }
}

/// The reason, for the user, why a grid cannot be fitted; else empty.
std::string reasonToSkip(const ArchiveEntry& entry, const GridSummary& grid) {
  if ((isScalarFloatTree(entry) || isVectorTree(entry)) && grid.activeVoxels == 0)
    return "it has no active voxel";
  if (isScalarFloatTree(entry)) return {};
  if (grid.isVector)
    return "its values are vectors (" + grid.valueType + "), which are fitted by components";
  if (isVectorTree(entry)) return "it is a level set of vectors, which cannot be fitted";
  const std::string type = entry.valueType();
  if (isPointTree(entry.treeType)) return "it holds points (" + type + "), which cannot be fitted";
  if (type == "float" || type == "double")
    return "its tree (" + shownName(entry.treeType) +
           ") cannot be fitted; OpenVDB's standard tree can";
  return notAFloatType(type);
}

/// Takes the counts from the file's statistics, if the writer stored them.
bool countFromStatistics(const std::vector<MetaItem>& items, GridSummary& grid) {
  using Corner = std::array<std::int32_t, 3>;
  const auto count = fixedValue<std::int64_t>(items, GridBase::META_FILE_VOXEL_COUNT, "int64");
  const auto low = fixedValue<Corner>(items, GridBase::META_FILE_BBOX_MIN, "vec3i");
  const auto high = fixedValue<Corner>(items, GridBase::META_FILE_BBOX_MAX, "vec3i");
  if (!count || !low || !high || *count < 0) return false;
  grid.activeVoxels = std::uint64_t(*count);
  if (*count > 0)
    grid.activeBox = {{(*low)[0], (*low)[1], (*low)[2]}, {(*high)[0], (*high)[1], (*high)[2]}};
  return true;
}

void countFromTree(Archive& archive, const ArchiveEntry& entry, Surveys& surveys,
                   GridSummary& grid) {
  if (!isPackedTree(entry)) return;
  const std::uint64_t owner = archive.treeOwner(entry).gridAt;
  auto survey = surveys.find(owner);
  if (survey == surveys.end())
    survey = surveys.emplace(owner, locateTree(archive, entry).survey).first;
  grid.activeVoxels = survey->second.activeVoxels;
  grid.activeBox = survey->second.activeBox;
}

GridSummary summarise(Archive& archive, const ArchiveEntry& entry, const GridHead& head,
                      Surveys& surveys) {
  GridSummary grid;
  grid.name = stringValue(head.metadata, GridBase::META_GRID_NAME);
  // A HalfGrid is like a grid of floats that is saved as half, which every version of OpenVDB reads.
  grid.valueType = isHalfTree(entry) ? "float" : entry.valueType();
  grid.savedAsHalf = entry.savedAsHalf || isHalfTree(entry);
  grid.storedBytes = entry.gridBytes;
  grid.gridClass = gridClassOf(stringValue(head.metadata, GridBase::META_GRID_CLASS));
  if (!countFromStatistics(head.metadata, grid)) countFromTree(archive, entry, surveys, grid);
  grid.isScalar = isScalarFloatTree(entry);
  grid.isVector =
      isVectorTree(entry) && grid.activeVoxels > 0 && grid.gridClass != GridClass::kLevelSet;
  grid.skipReason = reasonToSkip(entry, grid);
  grid.whyNotCarried = whyNotCarried(entry.treeType, archive.vdbVersion());
  return grid;
}

/// The name of a grid in errors: the unique name in the list of grids.
std::string shownNameOf(const Archive& archive, std::size_t place) {
  std::vector<std::string> names;
  for (const ArchiveEntry& entry : archive.entries()) names.push_back(entry.name());
  return GridNames(std::move(names)).unique(place);
}

/// Runs `body` and adds the name of a grid to the text of its errors.
template <class Body>
decltype(auto) inGridAt(const Archive& archive, std::size_t place, Body&& body) {
  return inNamedGrid([&] { return shownNameOf(archive, place); }, std::forward<Body>(body));
}

/// Lists one grid, whatever other grids the archive has. Its unique name is not set.
ListedGrid listGrid(Archive& archive, std::size_t place, Surveys& surveys) {
  requireGrid(place, archive.entries().size());
  return inGridAt(archive, place, [&] {
    const ArchiveEntry& entry = archive.entries()[place];
    ListedGrid listed{place, archive.readHead(entry), {}};
    listed.summary = summarise(archive, entry, listed.head, surveys);
    return listed;
  });
}

ListedGrid listGrid(Archive& archive, std::size_t place) {
  Surveys none;
  return listGrid(archive, place, none);
}

/// The properties of a grid, without its background.
GridDescriptor descriptorOf(const ListedGrid& listed) {
  const GridSummary& grid = listed.summary;
  const bool isDouble = grid.valueType == "double" || grid.valueType == "vec3d";
  return {.name = grid.name,
          .gridClass = grid.gridClass,
          .valueType = isDouble           ? ValueType::kDouble
                       : grid.savedAsHalf ? ValueType::kHalf
                                          : ValueType::kFloat,
          .transform = listed.head.transform,
          .metadata = withoutFileStatistics(listed.head.metadata)};
}

// Grids of an archive

/// \param component  of a grid of vectors; 0 for others
VolumeGrid readTree(Archive& archive, const ListedGrid& listed, std::size_t component,
                    const ReadOptions& options) {
  const ArchiveEntry& entry = archive.entries()[listed.place];
  const LocatedTree located = locateTree(archive, entry);
  VolumeGrid grid;
  grid.descriptor = descriptorOf(listed);
  const auto is = [&](const openvdb::Name& type) { return entry.treeType == type; };
  if (is(openvdb::DoubleTree::treeType()))
    readVoxelsAs<openvdb::DoubleTree>(archive, located, component, options, grid);
  else if (isHalfTree(entry))
    readVoxelsAs<HalfTree>(archive, located, component, options, grid);
  else if (is(openvdb::Vec3STree::treeType()))
    readVoxelsAs<openvdb::Vec3STree>(archive, located, component, options, grid);
  else if (is(openvdb::Vec3DTree::treeType()))
    readVoxelsAs<openvdb::Vec3DTree>(archive, located, component, options, grid);
  else
    readVoxelsAs<openvdb::FloatTree>(archive, located, component, options, grid);
  return grid;
}

VolumeGrid readListedGrid(Archive& archive, const ListedGrid& listed, const ReadOptions& options) {
  return inGridAt(archive, listed.place, [&] {
    // Only the type is checked here. Statistics that call the grid empty may be wrong.
    if (!isScalarFloatTree(archive.entries()[listed.place]))
      throw BadInput(listed.summary.skipReason);
    return readTree(archive, listed, 0, options);
  });
}

/// Adds the component to the text of errors.
VolumeGrid readListedComponent(Archive& archive, const ListedGrid& listed, std::size_t component,
                               const ReadOptions& options) {
  inGridAt(archive, listed.place, [&] {
    const GridSummary& grid = listed.summary;
    if (!grid.isVector)
      throw BadInput(grid.isScalar ? "its values are numbers, not vectors" : grid.skipReason);
  });
  return inNamedGrid([&] { return componentName(shownNameOf(archive, listed.place), component); },
                     [&] { return readTree(archive, listed, component, options); });
}

VectorGrid readListedVector(Archive& archive, const ListedGrid& listed,
                            const ReadOptions& options) {
  return joinedComponents(options, [&](std::size_t c, const ReadOptions& left) {
    return readListedComponent(archive, listed, c, left);
  });
}

PackedGrid readListedPacked(Archive& archive, const ListedGrid& listed,
                            const ReadOptions& options) {
  return inGridAt(archive, listed.place, [&]() -> PackedGrid {
    const ArchiveEntry& entry = archive.entries()[listed.place];
    if (!isPackedTree(entry))
      throw BadInput("its tree (" + shownName(entry.treeType) +
                     ") cannot be read; those of numbers, 3D vectors and masks can");
    return {descriptorOf(listed), readPackedVoxels(archive, entry, options)};
  });
}

}  // namespace

VdbSummary inspectOpenVdb(InputFile& file) {
  Archive archive(file);
  VdbSummary summary{"OpenVDB", file.size(), archive.metadata(), {}};
  Surveys surveys;
  for (std::size_t place = 0; place < archive.entries().size(); ++place) {
    ListedGrid listed = listGrid(archive, place, surveys);
    listed.summary.metadata = withoutFileStatistics(std::move(listed.head.metadata));
    summary.grids.push_back(std::move(listed.summary));
  }
  summary.directory = archive.directory();
  return summary;
}

VolumeGrid readOpenVdbGrid(InputFile& file, std::size_t place, const ReadOptions& options) {
  Archive archive(file, options.directory);
  return readListedGrid(archive, listGrid(archive, place), options);
}

VolumeGrid readOpenVdbComponent(InputFile& file, std::size_t place, std::size_t component,
                                const ReadOptions& options) {
  Archive archive(file, options.directory);
  VolumeGrid grid = readListedComponent(archive, listGrid(archive, place), component, options);
  grid.descriptor.name = componentName(grid.descriptor.name, component);
  if (component > 0) grid.descriptor.metadata.clear();
  return grid;
}

VectorGrid readOpenVdbVector(InputFile& file, std::size_t place, const ReadOptions& options) {
  Archive archive(file, options.directory);
  return readListedVector(archive, listGrid(archive, place), options);
}

PackedGrid readOpenVdbPacked(InputFile& file, std::size_t place, const ReadOptions& options) {
  Archive archive(file, options.directory);
  return readListedPacked(archive, listGrid(archive, place), options);
}

std::vector<CarriedGrid> readOpenVdbCarried(InputFile& file, std::span<const std::size_t> places,
                                            const ReadOptions& options) {
  Archive archive(file, options.directory);
  MemoryBudget budget(options.maxBytes);
  std::vector<CarriedGrid> grids;
  for (const std::size_t place : places)
    inGrid(archive.entries().at(place).name(), [&] {
      const std::uint64_t bytes = archive.treeOwner(archive.entries()[place]).gridBytes;
      budget.take(options.memory.isInFile(bytes) ? 0.0 : double(bytes), "carrying it unchanged");
      grids.push_back(carry(archive, place, options.memory));
    });
  return grids;
}

}  // namespace esvr::vdb

namespace esvr {

GridSummary inspectCarried(const CarriedGrid& grid) {
  vdb::InputFile file(std::span(grid.bytes));
  vdb::Archive archive(file, grid);
  vdb::ListedGrid listed = vdb::listGrid(archive, 0);
  listed.summary.uniqueName = shownName(listed.summary.name);
  listed.summary.metadata = vdb::withoutFileStatistics(std::move(listed.head.metadata));
  return std::move(listed.summary);
}

VolumeGrid readGrid(const CarriedGrid& grid, const ReadOptions& options) {
  vdb::InputFile file(std::span(grid.bytes));
  vdb::Archive archive(file, grid);
  return vdb::readListedGrid(archive, vdb::listGrid(archive, 0), options);
}

VectorGrid readVector(const CarriedGrid& grid, const ReadOptions& options) {
  vdb::InputFile file(std::span(grid.bytes));
  vdb::Archive archive(file, grid);
  return vdb::readListedVector(archive, vdb::listGrid(archive, 0), options);
}

PackedGrid readPacked(const CarriedGrid& grid, const ReadOptions& options) {
  vdb::InputFile file(std::span(grid.bytes));
  vdb::Archive archive(file, grid);
  return vdb::readListedPacked(archive, vdb::listGrid(archive, 0), options);
}

}  // namespace esvr
