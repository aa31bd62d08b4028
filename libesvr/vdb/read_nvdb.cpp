#include "vdb/formats.h"

#include <blosc.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <memory>
#include <new>
#include <type_traits>

#include "esvr/device.h"
#include "esvr/error.h"
#include "esvr/grid.h"
#include "vdb/brick_filler.h"
#include "vdb/properties.h"
#include "vdb/write_nvdb.h"

// Reads .nvdb files. Directory, buffers and nodes are read here, because NanoVDB does not check sizes: every
// offset is checked before it is followed.
//
// In the layout of NanoVDB's major version 32, a file consists of segments: each has a header of 16 bytes,
// then 176 bytes and a name for each grid, and then the buffer of each grid, compressed as the header says. A file
// may also consist of buffers alone ("raw" files, as GridHandle::write makes them).

namespace esvr::vdb {
namespace {

// The directory

constexpr std::uint64_t kMagicOld =
    0x304244566f6e614eu;  // "NanoVDB0": a file, and before 32.6 also a buffer
constexpr std::uint64_t kMagicGrid = 0x314244566f6e614eu;  // "NanoVDB1"
constexpr std::uint64_t kMagicFile = 0x324244566f6e614eu;  // "NanoVDB2"

enum NanoCodec : std::uint16_t { kNone = 0, kZip = 1, kBlosc = 2 };

struct SegmentHeader {
  std::uint64_t magic;
  std::uint32_t version;
  std::uint16_t gridCount;
  std::uint16_t codec;
};
static_assert(sizeof(SegmentHeader) == 16);

struct GridRow {
  std::uint64_t gridBytes, storedBytes, nameHash, activeVoxels;
  std::uint32_t gridType, gridClass;
  double worldBox[6];
  Box indexBox;
  double voxelSize[3];
  std::uint32_t nameBytes;
  std::uint32_t nodeCount[4];
  std::uint32_t tileCount[3];
  std::uint16_t codec, padding;
  std::uint32_t version;
};
static_assert(sizeof(GridRow) == 176);

/// The directory's entry for one grid. The numbers of its type and class are NanoVDB's.
struct NanoEntry {
  std::string name;
  std::uint32_t gridType = 0;
  std::uint32_t gridClass = 0;
  std::uint64_t activeVoxels = 0;
  Box activeBox;
  std::uint16_t codec = 0;
  std::uint64_t gridBytes = 0;  ///< size in memory
  std::uint64_t storedBytes = 0;
  std::uint64_t at = 0;
};

/// OpenVDB's name for the value type of a NanoVDB grid ("float"), or NanoVDB's own name if OpenVDB
/// has none ("fp8").
std::string nanoValueType(std::uint32_t gridType) {
  constexpr std::array kNames{
      "unknown",   "float",       "double",     "int16",  "int32",   "int64", "vec3s",
      "vec3d",     "mask",        "half",       "uint32", "bool",    "rgba8", "fp4",
      "fp8",       "fp16",        "fpn",        "vec4s",  "vec4d",   "index", "onindex",
      "indexmask", "onindexmask", "pointindex", "vec3u8", "vec3u16", "uint8"};
  return gridType < kNames.size() ? kNames[gridType] : "number " + std::to_string(gridType);
}

bool hasReadMajor(std::uint32_t version) { return version >> 21 == NANOVDB_MAJOR_VERSION_NUMBER; }

/// \throws BadInput  the version has another layout
void requireVersion(std::uint32_t version) {
  if (hasReadMajor(version)) return;
  // The version in full, because the first ones have the major version 0: "0.0.28".
  constexpr std::uint32_t kMinorMask = (1u << 11) - 1, kPatchMask = (1u << 10) - 1;
  throw BadInput("was written by NanoVDB " + std::to_string(version >> 21) + '.' +
                 std::to_string((version >> 10) & kMinorMask) + '.' +
                 std::to_string(version & kPatchMask) + ", this program reads version " +
                 std::to_string(NANOVDB_MAJOR_VERSION_NUMBER));
}

/// True if a buffer follows instead of a segment. Before 32.6, both began with the same number, and the words
/// where one of them has its version decide.
bool bufferFollows(InputFile& file) {
  struct Words {
    std::uint64_t magic;
    std::uint32_t versionOfSegment, other, versionOfBuffer;
  };
  const std::uint64_t at = file.position();
  if (file.remaining() < sizeof(Words)) return false;
  const auto words = file.read<Words>();
  file.seek(at);
  return words.magic == kMagicGrid ||
         (words.magic == kMagicOld && !hasReadMajor(words.versionOfSegment) &&
          hasReadMajor(words.versionOfBuffer));
}

/// Reads what a directory would say about a buffer from the buffer itself.
/// \throws BadInput  the buffer has another version or is cut
NanoEntry readBuffer(InputFile& file) {
  struct Tree {
    std::int64_t nodesAt[4];  ///< from here to the first leaf, lower node, upper node and root
    std::uint32_t nodeCount[3], tileCount[3];
    std::uint64_t activeVoxels;
  };
  static_assert(sizeof(Tree) == 64 && sizeof(nanovdb::GridData) == 672);
  NanoEntry entry;
  entry.at = file.position();
  const auto grid = file.read<nanovdb::GridData>();
  requireVersion(grid.mVersion.id());
  const std::uint64_t treeAt = file.position();
  const auto tree = file.read<Tree>();
  const std::uint64_t headBytes = file.position() - entry.at;
  if (grid.mGridSize < headBytes || grid.mGridSize - headBytes > file.remaining())
    throw BadInput("is damaged: a grid of an impossible size");
  entry.gridBytes = entry.storedBytes = grid.mGridSize;
  const InputFile::Within buffer(file, entry.at + grid.mGridSize);
  entry.name.assign(grid.mGridName, strnlen(grid.mGridName, sizeof grid.mGridName));
  entry.gridType = std::uint32_t(grid.mGridType);
  entry.gridClass = std::uint32_t(grid.mGridClass);
  entry.activeVoxels = tree.activeVoxels;
  if (tree.activeVoxels > 0) {
    file.seek(treeAt + std::uint64_t(tree.nodesAt[3]));
    entry.activeBox = file.read<Box>();  // the first member of a root
  }
  return entry;
}

/// \throws BadInput  there is no header, or it is of another version
SegmentHeader readSegmentHeader(InputFile& file) {
  const auto header = file.read<SegmentHeader>();
  if (header.magic != kMagicOld && header.magic != kMagicFile)
    throw BadInput("is damaged: no NanoVDB header where one should be");
  requireVersion(header.version);
  return header;
}

NanoEntry readEntry(InputFile& file, std::uint16_t codec) {
  const auto row = file.read<GridRow>();
  const auto name = file.readBytes(row.nameBytes);
  NanoEntry entry;
  const auto end = std::find(name.begin(), name.end(), std::byte{0});
  entry.name.assign(reinterpret_cast<const char*>(name.data()), std::size_t(end - name.begin()));
  entry.gridType = row.gridType;
  entry.gridClass = row.gridClass;
  entry.activeVoxels = row.activeVoxels;
  if (row.activeVoxels > 0) entry.activeBox = row.indexBox;
  entry.codec = codec;
  entry.gridBytes = row.gridBytes;
  entry.storedBytes = row.storedBytes;
  return entry;
}

/// \throws BadInput  the file has another version, or is damaged
std::vector<NanoEntry> readNanoDirectory(InputFile& file) {
  std::vector<NanoEntry> entries;
  file.seek(0);
  while (file.remaining() > 0) {
    if (bufferFollows(file)) {
      entries.push_back(readBuffer(file));
      file.seek(entries.back().at);
      file.skip(entries.back().storedBytes);
      continue;
    }
    const auto header = readSegmentHeader(file);
    const std::size_t first = entries.size();
    for (int i = 0; i < header.gridCount; ++i) entries.push_back(readEntry(file, header.codec));
    for (std::size_t i = first; i < entries.size(); ++i) {
      entries[i].at = file.position();
      file.skip(entries[i].storedBytes);
    }
  }
  return entries;
}

// Buffers

/// The buffer of a grid, with the alignment that NanoVDB needs.
class NanoBuffer {
 public:
  explicit NanoBuffer(std::size_t bytes)
      : bytes_(static_cast<std::byte*>(::operator new(bytes, kAlignment))), size_(bytes) {}
  [[nodiscard]] std::byte* data() const { return bytes_.get(); }
  [[nodiscard]] std::size_t size() const { return size_; }

 private:
  static constexpr std::align_val_t kAlignment{64};
  struct Free {
    void operator()(std::byte* bytes) const { ::operator delete(bytes, kAlignment); }
  };
  std::unique_ptr<std::byte, Free> bytes_;
  std::size_t size_;
};

constexpr std::uint64_t kBloscChunk = std::uint64_t{1} << 30;  // bytes before compression

void unzip(InputFile& file, const NanoEntry& entry, NanoBuffer& to) {
  const auto packed = file.readBytes(file.read<std::uint64_t>());
  uLongf unpacked = to.size();
  const int status = uncompress(reinterpret_cast<Bytef*>(to.data()), &unpacked,
                                reinterpret_cast<const Bytef*>(packed.data()), packed.size());
  if (status != Z_OK || unpacked != entry.gridBytes)
    throw BadInput("is damaged: its zip data do not unpack");
}

void unblosc(InputFile& file, NanoBuffer& to) {
  for (std::uint64_t done = 0; done < to.size();) {
    const std::uint64_t raw = std::min<std::uint64_t>(to.size() - done, kBloscChunk);
    const auto packed = file.readBytes(file.read<std::uint64_t>());
    std::size_t announced = 0;
    if (packed.size() < BLOSC_MIN_HEADER_LENGTH ||
        blosc_cbuffer_validate(packed.data(), packed.size(), &announced) != 0 || announced != raw ||
        blosc_decompress_ctx(packed.data(), to.data() + done, raw, 1) != int(raw))
      throw BadInput("is damaged: its Blosc data do not unpack");
    done += raw;
  }
}

/// \throws BadInput  the buffer is damaged
/// \throws MemoryExceeded  the buffer is larger than maxBytes
NanoBuffer readNanoBuffer(InputFile& file, const NanoEntry& entry, std::uint64_t maxBytes) {
  file.seek(entry.at);
  if (entry.codec == kNone) file.need(entry.gridBytes);
  requireWithinMemory(double(entry.gridBytes), maxBytes, "it");
  NanoBuffer buffer(entry.gridBytes);
  switch (entry.codec) {
    case kNone:
      file.read(buffer.data(), buffer.size());
      break;
    case kZip:
      unzip(file, entry, buffer);
      break;
    case kBlosc:
      unblosc(file, buffer);
      break;
    default:
      throw BadInput("is packed by an unknown codec, number " + std::to_string(entry.codec));
  }
  return buffer;
}

// Voxels

[[noreturn]] void damaged(const char* what) { throw BadInput(std::string("is damaged: ") + what); }

const nanovdb::GridData& gridData(const NanoBuffer& buffer) {
  return *reinterpret_cast<const nanovdb::GridData*>(buffer.data());
}

/// A number, or a component of a vector.
template <class Value>
auto numberOf(const Value& value, std::size_t component) {
  if constexpr (std::is_arithmetic_v<Value>)
    return value;
  else
    return value[int(component)];
}

/// The nodes of one grid. Coordinates follow from the positions of the nodes in the tree; the
/// coordinates that the nodes hold are not used.
template <class Build>
class NanoTree {
 public:
  using Grid = nanovdb::NanoGrid<Build>;
  using Root = nanovdb::NanoRoot<Build>;
  using Upper = nanovdb::NanoUpper<Build>;
  using Lower = nanovdb::NanoLower<Build>;
  using Leaf = nanovdb::NanoLeaf<Build>;

  /// \throws BadInput  a header, a tree or a root reaches beyond the buffer
  explicit NanoTree(const NanoBuffer& buffer) : buffer_(buffer) {
    constexpr std::uint64_t kTreeAt = sizeof(nanovdb::GridData);
    using TreeData = std::remove_cvref_t<decltype(*std::declval<Grid>().tree().data())>;
    if (buffer.size() < kTreeAt + sizeof(TreeData)) damaged("a grid without a tree");
    if (gridData(buffer).mGridType != nanovdb::ESVR_NANOVDB_GRID_TYPE<Build>())
      damaged("a grid of another type than its directory says");
    const auto& tree = *reinterpret_cast<const TreeData*>(buffer.data() + kTreeAt);
    root_ = node<Root>(&tree, std::int64_t(tree.mNodeOffset[kRootLevel]));
    const std::uint64_t tilesAt = place(root_) + sizeof(Root);
    const std::uint64_t tiles = root_->data()->mTableSize;
    if (tiles * sizeof(typename Root::Tile) > buffer.size() - tilesAt)
      damaged("a root node beyond its buffer");
  }

  [[nodiscard]] double background(std::size_t component) const {
    return numberOf(root_->background(), component);
  }

  /// Calls onLeaf(corner, leaf) and onTile(tile, isActive) for all leaves and tiles.
  /// \param component  of the vectors of tiles
  template <class OnLeaf, class OnTile>
  void visit(std::size_t component, OnLeaf&& onLeaf, OnTile&& onTileOfGrid) const {
    const auto onTile = [&](Coord corner, std::int32_t extent, const auto& value, bool isActive) {
      onTileOfGrid(TileSource{corner, extent, numberOf(value, component)}, isActive);
    };
    for (std::uint32_t i = 0; i < root_->data()->mTableSize; ++i) {
      const auto& tile = *root_->data()->tile(i);
      const auto origin = tile.origin();
      const Coord corner{origin[0], origin[1], origin[2]};
      if (tile.isChild())
        visitUpper(*node<Upper>(root_, tile.child), corner, onLeaf, onTile);
      else
        onTile(corner, kUpperExtent, tile.value, tile.state != 0);
    }
  }

 private:
  static constexpr int kRootLevel = 3;
  static constexpr std::int32_t kLowerExtent = 128, kUpperExtent = 4096;

  [[nodiscard]] std::uint64_t place(const void* p) const {
    return std::uint64_t(static_cast<const std::byte*>(p) - buffer_.data());
  }

  /// The node at an offset from another one.
  /// \throws BadInput  the node is not wholly in the buffer, or not aligned
  template <class Node>
  const Node* node(const void* from, std::int64_t offset) const {
    const std::uint64_t at = place(from) + std::uint64_t(offset);  // wraps for negative offsets
    if (at % NANOVDB_DATA_ALIGNMENT != 0 || at > buffer_.size() ||
        sizeof(Node) > buffer_.size() - at)
      damaged("a node outside of its grid");
    return reinterpret_cast<const Node*>(buffer_.data() + at);
  }

  /// The corner of the n-th cell of a node.
  template <class Node>
  static Coord cell(Coord corner, std::uint32_t n, std::int32_t extent) {
    constexpr std::uint32_t kLog2 = Node::LOG2DIM, kMask = (1u << kLog2) - 1;
    return corner + Coord{std::int32_t(n >> (2 * kLog2)), std::int32_t((n >> kLog2) & kMask),
                          std::int32_t(n & kMask)} *
                        extent;
  }

  template <class OnLeaf, class OnTile>
  void visitUpper(const Upper& upper, Coord corner, OnLeaf& onLeaf, OnTile& onTile) const {
    const auto& data = *upper.data();
    for (std::uint32_t n = 0; n < Upper::SIZE; ++n) {
      const Coord at = cell<Upper>(corner, n, kLowerExtent);
      if (data.mChildMask.isOn(n))
        visitLower(*node<Lower>(&upper, data.mTable[n].child), at, onLeaf, onTile);
      else
        onTile(at, kLowerExtent, data.mTable[n].value, data.mValueMask.isOn(n));
    }
  }

  template <class OnLeaf, class OnTile>
  void visitLower(const Lower& lower, Coord corner, OnLeaf& onLeaf, OnTile& onTile) const {
    const auto& data = *lower.data();
    for (std::uint32_t n = 0; n < Lower::SIZE; ++n) {
      const Coord at = cell<Lower>(corner, n, kBrickSide);
      if (data.mChildMask.isOn(n))
        onLeaf(at, leaf(lower, data.mTable[n].child));
      else
        onTile(at, kBrickSide, data.mTable[n].value, data.mValueMask.isOn(n));
    }
  }

  /// A leaf, including the values that follow it if its size varies (FpN).
  const Leaf& leaf(const Lower& lower, std::int64_t offset) const {
    const Leaf* found = node<Leaf>(&lower, offset);
    if constexpr (std::is_same_v<Build, nanovdb::FpN>)
      if (found->data()->bitWidth() > 16) damaged("a leaf of values wider than 16 bits");
    if (std::uint64_t(found->data()->memUsage()) > buffer_.size() - place(found))
      damaged("a leaf cut short");
    return *found;
  }

  const NanoBuffer& buffer_;
  const Root* root_ = nullptr;
};

/// Access to the leaves of NanoVDB for a brick filler. Their voxels are in voxelOffset order.
template <class Leaf>
struct NanoLeafAccess {
  std::size_t component = 0;  ///< of vectors

  [[nodiscard]] auto value(const Leaf& leaf, int i) const {
    return numberOf(leaf.data()->getValue(std::uint32_t(i)), component);
  }
  static BrickMask mask(const Leaf& leaf) {
    BrickMask mask;
    for (int i = 0; i < kBrickVoxels; ++i)
      if (leaf.data()->mValueMask.isOn(std::uint32_t(i))) mask.set(i);
    return mask;
  }
};

/// The corners of all bricks with an active voxel.
template <class Build>
std::vector<Coord> brickCorners(const NanoTree<Build>& tree, const ReadOptions& options) {
  std::uint64_t bricks = 0;
  const auto count = [&](std::int32_t extent) {
    const auto side = std::uint64_t(extent / kBrickSide);
    bricks += side * side * side;
    refuseTooLarge(bricks, options);
  };
  tree.visit(
      0, [&](Coord, const auto&) { count(kBrickSide); },
      [&](const TileSource& tile, bool isActive) {
        if (isActive) count(tile.extent);
      });
  std::vector<Coord> corners;
  corners.reserve(bricks);
  tree.visit(
      0,
      [&](Coord corner, const auto& leaf) {
        using Leaf = std::decay_t<decltype(leaf)>;
        if (NanoLeafAccess<Leaf>::mask(leaf).count() > 0) corners.push_back(corner);
      },
      [&](const TileSource& tile, bool isActive) {
        if (isActive) appendBricks(tile, corners);
      });
  return corners;
}

/// False for quantised values, whose inactive ones are only near those of the source.
template <class Build>
constexpr bool kHasExactValues =
    std::is_floating_point_v<Build> || std::is_same_v<Build, nanovdb::Vec3f> ||
    std::is_same_v<Build, nanovdb::Vec3d>;

/// \param component  of a grid of vectors; 0 for others
template <class Build>
void readNanoAs(const NanoBuffer& buffer, std::size_t component, const ReadOptions& options,
                VolumeGrid& grid) {
  using Leaf = typename NanoTree<Build>::Leaf;
  using Access = NanoLeafAccess<Leaf>;
  const NanoTree<Build> tree(buffer);
  const double background = tree.background(component);
  const Access access{component};
  grid.descriptor.background = background;
  const FillRules rules{narrowBackground(background),
                        grid.descriptor.gridClass == GridClass::kLevelSet,
                        options.nonFinite,
                        options.nonFiniteValue,
                        options.allowEmpty,
                        kHasExactValues<Build>};
  auto corners = brickCorners(tree, options);
  SparseVolume& volume = grid.volume = layOutBricks(corners, rules, options.memory);
  FillTallies tallies{rules.tally(), InactiveCounter(background, rules.levelSet)};
  tree.visit(
      component,
      [&](Coord corner, const Leaf& leaf) {
        if (Access::mask(leaf).count() == 0)
          countInactiveLeaf(leaf, access, rules, corner, tallies);
        else
          fillFromLeaf(leaf, access, rules, brickAt(volume, corner), volume, tallies);
      },
      [&](const TileSource& tile, bool isActive) {
        if (isActive)
          fillTile(tile, volume, tallies.nonFinite);
        else
          tallies.inactive.tile(tile);
      });
  refuseNonFinite(tallies.nonFinite, rules.nonFinite);
  grid.nonFiniteReplaced = tallies.nonFinite.count;
  grid.narrowing = tallies.nonFinite.narrowing;
  grid.inactive = tallies.inactive.lostIn(volume);
}

/// The classes that NanoVDB shares with OpenVDB have the same numbers here.
GridClass gridClassOf(std::uint32_t nanoClass) {
  return nanoClass <= std::uint32_t(GridClass::kStaggered) ? GridClass(nanoClass)
                                                           : GridClass::kUnknown;
}

/// The map as the simplest map of OpenVDB that is equal to it. NanoVDB stores an affine map only.
Transform transformOf(const NanoBuffer& buffer) {
  const auto& map = gridData(buffer).mMap;
  openvdb::math::Mat4d matrix = openvdb::math::Mat4d::identity();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) matrix(row, column) = map.mMatD[3 * column + row];
    matrix(3, row) = map.mVecD[row];
  }
  return fromMatrix(matrix);
}

/// Reads the grid in a buffer, without its name.
/// \param component  of a grid of vectors; 0 for others
/// \throws BadInput  the grid is damaged or has no active voxel; voxels are not finite
/// \throws MemoryExceeded  it takes more than options.maxBytes
VolumeGrid readNanoVoxels(const NanoBuffer& buffer, const NanoEntry& entry, std::size_t component,
                          const ReadOptions& options) {
  using Type = nanovdb::GridType;
  const auto type = Type(entry.gridType);
  const bool isDouble = type == Type::Double || type == Type::Vec3d;
  VolumeGrid grid;
  grid.descriptor.name = entry.name;
  grid.descriptor.gridClass = gridClassOf(entry.gridClass);
  grid.descriptor.valueType = isDouble ? ValueType::kDouble : ValueType::kFloat;
  switch (type) {
    case Type::Float:
      readNanoAs<float>(buffer, component, options, grid);
      break;
    case Type::Double:
      readNanoAs<double>(buffer, component, options, grid);
      break;
    case Type::Vec3f:
      readNanoAs<nanovdb::Vec3f>(buffer, component, options, grid);
      break;
    case Type::Vec3d:
      readNanoAs<nanovdb::Vec3d>(buffer, component, options, grid);
      break;
    case Type::Fp4:
      readNanoAs<nanovdb::Fp4>(buffer, component, options, grid);
      break;
    case Type::Fp8:
      readNanoAs<nanovdb::Fp8>(buffer, component, options, grid);
      break;
    case Type::Fp16:
      readNanoAs<nanovdb::Fp16>(buffer, component, options, grid);
      break;
    case Type::FpN:
      readNanoAs<nanovdb::FpN>(buffer, component, options, grid);
      break;
    default:
      throw BadInput("its values are of type " + nanoValueType(entry.gridType));
  }
  grid.descriptor.transform = transformOf(buffer);
  return grid;
}

// Grids

/// True for float, double and the quantised floats.
bool isScalarFloatNano(std::uint32_t gridType) {
  using Type = nanovdb::GridType;
  const auto type = Type(gridType);
  return type == Type::Float || type == Type::Double || type == Type::Fp4 || type == Type::Fp8 ||
         type == Type::Fp16 || type == Type::FpN;
}

bool isVectorNano(std::uint32_t gridType) {
  const auto type = nanovdb::GridType(gridType);
  return type == nanovdb::GridType::Vec3f || type == nanovdb::GridType::Vec3d;
}

/// The reason, for the user, why a grid cannot be fitted; else empty.
std::string reasonToSkip(const GridSummary& grid, bool hasVectors) {
  if (!grid.isScalar && !hasVectors) return notAFloatType(grid.valueType);
  if (grid.activeVoxels == 0) return "it has no active voxel";
  if (grid.isScalar) return {};
  if (grid.isVector)
    return "its values are vectors (" + grid.valueType + "), which are fitted by components";
  return "it is a level set of vectors, which cannot be fitted";
}

GridSummary summarise(const NanoEntry& entry) {
  GridSummary grid;
  grid.name = entry.name;
  grid.valueType = nanoValueType(entry.gridType);
  grid.gridClass = gridClassOf(entry.gridClass);
  grid.activeVoxels = entry.activeVoxels;
  grid.activeBox = entry.activeBox;
  grid.storedBytes = entry.storedBytes;
  grid.isScalar = isScalarFloatNano(entry.gridType);
  const bool hasVectors = isVectorNano(entry.gridType);
  grid.isVector = hasVectors && entry.activeVoxels > 0 && grid.gridClass != GridClass::kLevelSet;
  grid.skipReason = reasonToSkip(grid, hasVectors);
  grid.whyNotCarried = "only the grids of .vdb files can be carried unchanged";
  return grid;
}

}  // namespace

bool beginsAsNanoVdb(InputFile& file) {
  if (file.size() < sizeof(SegmentHeader)) return false;
  file.seek(0);
  const auto magic = file.read<std::uint64_t>();
  return magic == kMagicOld || magic == kMagicGrid || magic == kMagicFile;
}

VdbSummary inspectNanoVdb(InputFile& file) {
  VdbSummary summary{"NanoVDB", file.size(), {}, {}};
  for (const NanoEntry& entry : readNanoDirectory(file)) summary.grids.push_back(summarise(entry));
  return summary;
}

namespace {

/// The directory of a file and the grid at a place in it.
struct NanoPlace {
  std::vector<NanoEntry> entries;
  std::size_t place;

  NanoPlace(InputFile& file, std::size_t at) : entries(readNanoDirectory(file)), place(at) {
    requireGrid(place, entries.size());
  }
  [[nodiscard]] const NanoEntry& entry() const { return entries[place]; }
  [[nodiscard]] std::string uniqueName() const {
    std::vector<std::string> names;
    for (const NanoEntry& entry : entries) names.push_back(entry.name);
    return GridNames(std::move(names)).unique(place);
  }
};

/// \throws BadInput  the grid has not GridSummary::isVector
void requireVectors(const NanoPlace& at) {
  const GridSummary grid = summarise(at.entry());
  if (!grid.isVector)
    throw BadInput(grid.isScalar ? "its values are numbers, not vectors" : grid.skipReason);
}

}  // namespace

VolumeGrid readNanoVdbGrid(InputFile& file, std::size_t place, const ReadOptions& options) {
  const NanoPlace at(file, place);
  return inGrid(at.uniqueName(), [&] {
    const NanoEntry& entry = at.entry();
    if (!isScalarFloatNano(entry.gridType))
      throw BadInput(isVectorNano(entry.gridType) ? summarise(entry).skipReason
                                                  : notAFloatType(nanoValueType(entry.gridType)));
    return readNanoVoxels(readNanoBuffer(file, entry, options.maxBytes), entry, 0, options);
  });
}

VolumeGrid readNanoVdbComponent(InputFile& file, std::size_t place, std::size_t component,
                                const ReadOptions& options) {
  const NanoPlace at(file, place);
  inGrid(at.uniqueName(), [&] { requireVectors(at); });
  VolumeGrid grid = inGrid(componentName(at.uniqueName(), component), [&] {
    const NanoBuffer buffer = readNanoBuffer(file, at.entry(), options.maxBytes);
    return readNanoVoxels(buffer, at.entry(), component, options);
  });
  grid.descriptor.name = componentName(grid.descriptor.name, component);
  return grid;
}

VectorGrid readNanoVdbVector(InputFile& file, std::size_t place, const ReadOptions& options) {
  const NanoPlace at(file, place);
  inGrid(at.uniqueName(), [&] { requireVectors(at); });
  const NanoBuffer buffer =
      inGrid(at.uniqueName(), [&] { return readNanoBuffer(file, at.entry(), options.maxBytes); });
  return joinedComponents(options, [&](std::size_t c, const ReadOptions& left) {
    return inGrid(componentName(at.uniqueName(), c),
                  [&] { return readNanoVoxels(buffer, at.entry(), c, left); });
  });
}

}  // namespace esvr::vdb
