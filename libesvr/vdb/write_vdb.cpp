#include "vdb/formats.h"

#include <openvdb/io/Archive.h>
#include <openvdb/io/Compression.h>
#include <openvdb/io/GridDescriptor.h>
#include <openvdb/io/io.h>
#include <openvdb/tools/Prune.h>
#include <openvdb/tools/SignedFloodFill.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "core/parallel.h"
#include "esvr/device.h"
#include "esvr/error.h"
#include "esvr/grid.h"
#include "esvr/volume.h"
#include "vdb/archive.h"
#include "vdb/properties.h"

// Volumes become grids of OpenVDB, and grids become a .vdb file. Most grids hold no voxels: the leaves get
// them when they are written, one after the other. The tree of a large volume then takes a tenth of the
// memory of its voxels. The file is written grid by grid, so that grids of OpenVDB and grids that are only
// bytes may follow each other in any order.

namespace esvr::vdb {
namespace {

using openvdb::GridBase;

// Trees and leaves

// Voxels that a StreamedGrid writes have these functions: count() is the number of bricks, corner(b) and
// active(b) describe a brick, find(corner) is its number, and value(b, i, n) is the value at the offset i
// (voxelOffset), which is the n-th active one of the brick.

/// The numbers of a volume, which must outlive this object.
struct NumberVoxels {
  const SparseVolume& volume;

  [[nodiscard]] std::size_t count() const { return volume.brickCount(); }
  [[nodiscard]] Coord corner(std::size_t b) const { return volume.brickCorner(b); }
  [[nodiscard]] const BrickMask& active(std::size_t b) const { return volume.active[b]; }
  [[nodiscard]] std::size_t find(Coord corner) const { return brickWith(volume, corner).value(); }
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

/// The level in a tree of a tile that has the voxels of one brick.
constexpr openvdb::Index kTileOfABrick = 1;

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

  /// The bytes that the grid takes where it is read again, with its voxels. Its leaves do not hold theirs, and not all
  /// versions of OpenVDB have a function for leaves that will.
  [[nodiscard]] openvdb::Index64 memUsage() const override {
    openvdb::Index64 bytes = openvdb::tools::memUsage(this->tree());
    if constexpr (!std::is_same_v<Value, bool>)  // leaves of bits have no array of values
      for (auto leaf = this->tree().cbeginLeaf(); leaf; ++leaf)
        bytes += sizeof(Leaf) + Leaf::SIZE * sizeof(Value) - leaf->memUsage();
    return bytes;
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

// Grids

/// The number of nodes of a level that the bricks with active voxels have. \param side  of a node, voxels
template <class Voxels>
std::size_t nodesOf(const Voxels& voxels, int side) {
  std::vector<Coord> corners;
  for (std::size_t b = 0; b < voxels.count(); ++b) {
    if (voxels.active(b).count() == 0) continue;
    const Coord brick = voxels.corner(b), corner{brick.x & -side, brick.y & -side, brick.z & -side};
    if (corners.empty() || corners.back() != corner) corners.push_back(corner);
  }
  std::ranges::sort(corners);
  return std::size_t(std::unique(corners.begin(), corners.end()) - corners.begin());
}

/// Checks the memory of a tree. Its upper nodes have 0.3 MB each of floats, and voxels that are far from each other have
/// nodes of their own, so that a small file may ask for any amount. No limit accounts for
/// the memory of the program itself, nor for that of a small tree.
/// \throws MemoryExceeded
template <class Tree, class Voxels>
void requireRoomForTree(const Voxels& voxels, const std::string& name, std::uint64_t maxBytes) {
  using Leaf = typename Tree::LeafNodeType;
  using Upper = typename Tree::RootNodeType::ChildNodeType;
  using Lower = typename Upper::ChildNodeType;
  const auto bytesOf = [&]<class Node>(const Node*) {
    return double(nodesOf(voxels, int(Node::DIM))) * double(sizeof(Node));
  };
  const double bytes = bytesOf(static_cast<const Leaf*>(nullptr)) +
                       bytesOf(static_cast<const Lower*>(nullptr)) +
                       bytesOf(static_cast<const Upper*>(nullptr));
  constexpr double kSmall = 4e6;
  if (bytes > kSmall)
    requireWithinMemory(bytes, maxBytes, "the tree of OpenVDB for grid \"" + shownName(name) + '"');
}

/// A grid that holds the voxels of all bricks with active ones.
/// \tparam Voxels  as of StreamedGrid
template <class Tree, class Voxels>
typename openvdb::Grid<Tree>::Ptr gridInMemory(const Voxels& voxels,
                                               const typename Tree::ValueType& background) {
  auto grid = openvdb::Grid<Tree>::create(background);
  openvdb::tree::ValueAccessor<Tree> accessor(grid->tree());
  for (std::size_t b = 0; b < voxels.count(); ++b)
    if (voxels.active(b).count() > 0)
      accessor.addLeaf(makeLeaf<typename Tree::LeafNodeType>(voxels, b, background).release());
  return grid;
}

/// Gives the voxels of a brick that are not finite the background with the sign of their neighbours in the brick, from
/// the outside inward.
void takeSigns(std::span<float> values, float background) {
  constexpr std::array<Coord, 6> kSteps{
      {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}}};
  for (bool isChanged = true; isChanged;) {
    isChanged = false;
    const std::vector<float> before(values.begin(), values.end());
    for (int v = 0; v < kBrickVoxels; ++v) {
      if (std::isfinite(before[std::size_t(v)])) continue;
      double sum = 0.0;
      for (const Coord step : kSteps) {
        const Coord at = voxelLocal(v) + step;
        const float neighbour = before[std::size_t(voxelOffset(localOf(at)))];
        if (brickOf(at) == Coord{} && std::isfinite(neighbour)) sum += neighbour;
      }
      if (sum == 0.0) continue;
      values[std::size_t(v)] = float(std::copysign(background, sum));
      isChanged = true;
    }
  }
  for (float& value : values)
    if (!std::isfinite(value)) value = background;
}

/// The volume of a level set with a sign at each voxel that is not finite. A flood fill takes the signs of inactive
/// voxels from active ones, and these have none.
SparseVolume withSignsForNonFinite(SparseVolume volume) {
  for (std::size_t b = 0; b < volume.brickCount(); ++b)
    takeSigns(volume.brickValues(b), volume.background);
  return volume;
}

/// Sets the active voxels of leaves that are not finite.
template <class Tree>
void setNonFinite(const SparseVolume& volume, Tree& tree) {
  using Value = typename Tree::ValueType;
  openvdb::tree::ValueAccessor<Tree> accessor(tree);
  for (std::size_t b = 0; b < volume.brickCount(); ++b)
    forEachActive(volume.active[b], [&](int v) {
      const float value = volume.brickValues(b)[std::size_t(v)];
      const Coord at = volume.brickCorner(b) + voxelLocal(v);
      if (!std::isfinite(value))
        accessor.setValueOn(openvdb::Coord(at.x, at.y, at.z), Value(value));
    });
}

/// Gives the inactive voxels of a level set the background with the sign of their side: those in leaves the sign that the
/// volume has, and tiles that of the empty space, if it has one. A flood fill of the leaves would take the signs from the
/// active voxels before them, and where a band has a hole within a leaf, all space could become the inside.
template <class Tree>
void setSigns(const SparseVolume& volume, Tree& tree) {
  openvdb::tree::ValueAccessor<Tree> accessor(tree);
  for (std::size_t b = 0; b < volume.brickCount(); ++b) {
    const Coord at = volume.brickCorner(b);
    auto* const leaf = accessor.probeLeaf(openvdb::Coord(at.x, at.y, at.z));
    for (int v = 0; leaf && v < kBrickVoxels; ++v)
      if (!volume.active[b].test(v) && volume.brickValues(b)[std::size_t(v)] < 0.0f)
        leaf->setValueOnly(openvdb::Index(v), -tree.background());
  }
  constexpr openvdb::Index kFirstOfTiles = 1;  // level in the tree
  if (EmptySigns(volume).agree()) openvdb::tools::signedFloodFill(tree, true, 1, kFirstOfTiles);
}

/// Replaces leaves whose voxels are all active and equal by tiles, and these by larger ones. OpenVDB's prune() takes a NaN
/// to be equal to any number, so that one in a leaf of equal voxels is lost, or becomes all of them.
template <class Tree>
void mergeEqualVoxels(Tree& tree) {
  using Leaf = typename Tree::LeafNodeType;
  std::vector<const Leaf*> equal;
  for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) {
    const auto* const values = leaf->buffer().data();
    const bool isEqual = leaf->isDense() && std::all_of(values + 1, values + Leaf::SIZE,
                                                        [&](auto v) { return v == *values; });
    if (isEqual) equal.push_back(&*leaf);
  }
  for (const Leaf* leaf : equal) {
    const auto value = leaf->buffer()[0];
    tree.addTile(kTileOfABrick, openvdb::Coord(leaf->origin()), value, true);
  }
  openvdb::tools::pruneTiles(tree);
}

template <class Tree>
GridBase::Ptr makeGrid(const VolumeGrid& source, const WriteOptions& options, LeafVoxels voxels) {
  const auto background = typename Tree::ValueType(source.descriptor.background);
  const bool levelSet = source.descriptor.gridClass == GridClass::kLevelSet;
  requireRoomForTree<Tree>(NumberVoxels{source.volume}, source.descriptor.name, options.maxBytes);
  // The flood fill of a level set needs the voxels of all leaves.
  if (voxels == LeafVoxels::kWhenWritten && !levelSet)
    return std::make_shared<StreamedGrid<Tree, NumberVoxels>>(NumberVoxels{source.volume},
                                                              background, options.constantTiles);
  const bool isSigned = levelSet && background > 0 && hasNonFinite(source.volume);
  const SparseVolume withSigns = isSigned ? withSignsForNonFinite(source.volume) : SparseVolume{};
  const SparseVolume& volume = isSigned ? withSigns : source.volume;
  const auto grid = gridInMemory<Tree>(NumberVoxels{volume}, background);
  Tree& tree = grid->tree();
  // The flood fill overwrites active tiles, so it runs before there are any.
  if (levelSet && background > 0) setSigns(volume, tree);
  if (isSigned) setNonFinite(source.volume, tree);
  if (options.constantTiles) {
    mergeEqualVoxels(tree);
    keepLeaves(NumberVoxels{volume}, tree);
  }
  return grid;
}

template <class Tree>
GridBase::Ptr makeVectors(const VectorGrid& source, const WriteOptions& options,
                          LeafVoxels voxels) {
  using Vector = typename Tree::ValueType;
  const openvdb::Vec3d background(source.background.data());
  VectorVoxels vectors{aligned(source.components)};
  requireRoomForTree<Tree>(vectors, source.descriptor.name, options.maxBytes);
  if (voxels == LeafVoxels::kInMemory) return gridInMemory<Tree>(vectors, Vector(background));
  return std::make_shared<StreamedGrid<Tree, VectorVoxels>>(std::move(vectors), Vector(background),
                                                            options.constantTiles);
}

template <class T>
GridBase::Ptr makePacked(const PackedVoxels<T>& voxels, const WriteOptions& options) {
  using Tree = typename openvdb::tree::Tree4<decltype(openVdbValue(voxels.background))>::Type;
  return std::make_shared<StreamedGrid<Tree, StreamedPacked<T>>>(
      StreamedPacked<T>{voxels}, openVdbValue(voxels.background), options.constantTiles);
}

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

/// Restores the properties in the source's metadata and then those in the descriptor, because a
/// descriptor that was made from scratch has no metadata.
void restoreDescriptor(const GridDescriptor& descriptor, GridBase& grid) {
  insertItems(descriptor.metadata, grid);
  if (grid.getName() != descriptor.name) grid.setName(descriptor.name);
  const auto gridClass = openVdbClass(descriptor.gridClass);
  if (grid.getGridClass() != gridClass) grid.setGridClass(gridClass);
  grid.setTransform(toOpenVdb(descriptor.transform));
}

// Halfs have NaN and infinities.
bool isHalf(float value) {
  return !std::isfinite(value) || float(openvdb::math::half(value)) == value;
}
bool fitsHalf(float value) {
  return !std::isfinite(value) || std::isfinite(float(openvdb::math::half(value)));
}

/// True if all active voxels and the background are numbers of a kind.
template <class Test>
bool allAre(const SparseVolume& volume, double background, const Test& test) {
  bool all = test(float(background));
  for (std::size_t b = 0; all && b < volume.brickCount(); ++b)
    for (int i = 0; i < kBrickVoxels; ++i)
      if (volume.active[b].test(i)) all &= test(volume.brickValues(b)[i]);
  return all;
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
    throw UsageError("grid \"" + shownName(descriptor.name) +
                     "\" has values beyond 65504, the largest that half precision holds; do not "
                     "ask for halfs");
  if (half != grid.saveFloatAsHalf()) grid.setSaveFloatAsHalf(half);
}

// Files

/// OpenVDB's own functions write the header and the parts of a grid. They write to a stream that
/// throws, unlike OpenVDB's class File.
///
/// Archive::writeGrid() is not used: it compresses all voxels a first time, to store the bytes of
/// each leaf in the metadata item `file_delayed_load`. A StreamedGrid holds no voxels then, so that
/// the item would be wrong, and applications that load voxels when they need them, such as Blender,
/// would crash. Without the item, they find the bytes of each leaf in front of its voxels.
class ArchiveWriter : private openvdb::io::Archive {
 public:
  /// Writes the header.
  /// \param stream       must be seekable and outlive this object
  /// \param compression  OpenVDB's flags
  /// \param names        names of all grids that are added later, in their order
  ArchiveWriter(std::ostream& stream, std::uint32_t compression, const openvdb::MetaMap& metadata,
                std::vector<std::string> names);

  void add(const openvdb::GridBase::ConstPtr& grid);
  /// \throws RuntimeFailure  the bytes are of a version of the format that OpenVDB does not write
  void add(const CarriedGrid& grid);

 private:
  /// The name of the next grid in the directory, which no grid before it has.
  std::string nextName();

  std::ostream& stream_;
  openvdb::io::StreamMetadata::Ptr state_;  ///< the stream points to this member
  std::vector<std::string> names_;
  std::unordered_map<std::string, int> counts_;   ///< of grids by their names
  std::unordered_map<std::string, int> numbers_;  ///< the next numbers of grids that share a name
  std::unordered_set<std::string> taken_;         ///< names of the directory so far
  std::size_t next_ = 0;
};

/// Writes the metadata of a grid with its statistics.
void writeMetadata(const openvdb::GridBase& grid, std::ostream& stream) {
  using openvdb::GridBase;
  const auto copy = openvdb::ConstPtrCast<GridBase>(grid.copyGrid());  // shares the tree
  copy->addStatsMetadata();
  // The copy does not know how many bytes the voxels of a StreamedGrid take.
  copy->insertMeta(GridBase::META_FILE_MEM_BYTES,
                   openvdb::Int64Metadata(openvdb::Int64(grid.memUsage())));
  const auto packing = openvdb::io::compressionToString(openvdb::io::getDataCompression(stream));
  copy->insertMeta(GridBase::META_FILE_COMPRESSION, openvdb::StringMetadata(packing));
  copy->writeMeta(stream);
}

ArchiveWriter::ArchiveWriter(std::ostream& stream, std::uint32_t compression,
                             const openvdb::MetaMap& metadata, std::vector<std::string> names)
    : stream_(stream),
      state_(std::make_shared<openvdb::io::StreamMetadata>()),
      names_(std::move(names)) {
  setCompression(compression);
  openvdb::io::setStreamMetadataPtr(stream_, state_, /*transfer=*/false);
  openvdb::io::setDataCompression(stream_, compression);
  writeHeader(stream_, /*seekable=*/true);
  metadata.writeMeta(stream_);
  for (const std::string& name : names_) ++counts_[name];
  const auto count = std::int32_t(names_.size());
  stream_.write(reinterpret_cast<const char*>(&count), sizeof count);
}

void ArchiveWriter::add(const openvdb::GridBase::ConstPtr& grid) {
  openvdb::io::GridDescriptor row(nextName(), grid->type(), grid->saveFloatAsHalf());
  row.writeHeader(stream_);
  const auto positions = stream_.tellp();
  row.writeStreamPos(stream_);
  row.setGridPos(stream_.tellp());
  setGridCompression(stream_, *grid);
  writeMetadata(*grid, stream_);
  grid->writeTransform(stream_);
  grid->writeTopology(stream_);
  row.setBlockPos(stream_.tellp());
  grid->writeBuffers(stream_);
  row.setEndPos(stream_.tellp());
  stream_.seekp(positions);
  row.writeStreamPos(stream_);
  row.seekToEnd(stream_);
  // Some flags of the compression depend on the grid.
  openvdb::io::setDataCompression(stream_, compression());
}

void ArchiveWriter::add(const CarriedGrid& grid) {
  if (const auto why = whyNotCarried(grid.treeType, grid.vdbVersion); !why.empty())
    throw RuntimeFailure("grid \"" + shownName(grid.name) + "\" cannot be written: " + why);
  openvdb::io::GridDescriptor row(nextName(), grid.treeType, grid.savedAsHalf);
  row.writeHeader(stream_);
  constexpr std::int64_t kPositionBytes = 3 * sizeof(std::int64_t);
  const std::int64_t begin = std::int64_t(stream_.tellp()) + kPositionBytes;
  row.setGridPos(begin);
  row.setBlockPos(begin + std::int64_t(grid.blocksAt));
  row.setEndPos(begin + std::int64_t(grid.bytes.size()));
  row.writeStreamPos(stream_);
  stream_.write(reinterpret_cast<const char*>(grid.bytes.data()),
                std::streamsize(grid.bytes.size()));
}

std::string ArchiveWriter::nextName() {
  using openvdb::io::GridDescriptor;
  const std::string& name = names_.at(next_++);
  const bool isAlone = !name.empty() && counts_.at(name) == 1;
  if (isAlone && taken_.insert(name).second) return name;
  for (int& number = numbers_[name];;) {
    std::string unique = GridDescriptor::addSuffix(name, number++);
    // OpenVDB also finds this grid by "NAME[number]", which another grid may be called.
    if (counts_.contains(GridDescriptor::nameAsString(unique))) continue;
    if (taken_.insert(unique).second) return unique;
  }
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

GridBase::Ptr makeOpenVdbGrid(const VectorGrid& source, const WriteOptions& options,
                              LeafVoxels voxels) {
  initializeOpenVdb();
  GridBase::Ptr grid = source.descriptor.valueType == ValueType::kDouble
                           ? makeVectors<openvdb::Vec3DTree>(source, options, voxels)
                           : makeVectors<openvdb::Vec3STree>(source, options, voxels);
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

namespace {

std::vector<std::string> namesOf(std::span<const GridToWrite> grids) {
  std::vector<std::string> names;
  for (const auto& grid : grids)
    names.push_back(std::visit(
        [](const auto* any) {
          if constexpr (std::is_same_v<decltype(any), const CarriedGrid*>)
            return any->name;
          else
            return any->descriptor.name;
        },
        grid));
  return names;
}

}  // namespace

void forEachNamed(std::span<const GridToWrite> grids,
                  const std::function<void(std::size_t)>& body) {
  const std::vector<std::string> names = namesOf(grids);
  const GridNames unique(names);
  for (std::size_t g = 0; g < grids.size(); ++g) try {
      body(g);
    } catch (Error& error) {
      error.nameGrid(shownName(names[g]), unique.unique(g));
      throw;
    }
}

void writeOpenVdb(const std::filesystem::path& path, std::span<const MetaItem> fileMetadata,
                  std::span<const GridToWrite> grids, const WriteOptions& options) {
  initializeOpenVdb();
  // An item names this library as the writer, unless the source's metadata has one.
  openvdb::MetaMap metadata;
  insertItems(fileMetadata, metadata);
  if (!findItem(fileMetadata, kWriterKey))
    insertItems(std::array{stringItem(kWriterKey, "esvr " ESVR_VERSION)}, metadata);
  std::ofstream stream(path, std::ios::binary);
  stream.exceptions(std::ios::badbit | std::ios::failbit);
  using namespace openvdb::io;
  const std::uint32_t compression =
      COMPRESS_ACTIVE_MASK |
      (openvdb::io::Archive::hasBloscCompression() ? COMPRESS_BLOSC : COMPRESS_ZIP);
  ArchiveWriter writer(stream, compression, metadata, namesOf(grids));
  forEachNamed(grids, [&](std::size_t g) {
    std::visit(
        [&](const auto* any) {
          if constexpr (std::is_same_v<decltype(any), const CarriedGrid*>)
            writer.add(*any);
          else if constexpr (std::is_same_v<decltype(any), const VolumeGrid*>)
            writer.add(makeOpenVdbGrid(*any, options, LeafVoxels::kWhenWritten));
          else
            writer.add(makeOpenVdbGrid(*any, options));
        },
        grids[g]);
  });
  stream.close();
}

}  // namespace esvr::vdb
