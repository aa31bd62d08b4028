#include "vdb/nano_grid.h"

#include <nanovdb/NanoVDB.h>

#include <array>
#include <type_traits>

#include "esvr/error.h"
#include "vdb/brick_filler.h"
#include "vdb/transform.h"

namespace esvr::vdb {
namespace {

[[noreturn]] void damaged(const char* what) { throw BadInput(std::string("is damaged: ") + what); }

const nanovdb::GridData& gridData(const NanoBuffer& buffer) {
  return *reinterpret_cast<const nanovdb::GridData*>(buffer.data());
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

  [[nodiscard]] double background() const { return double(root_->background()); }

  /// Calls onLeaf(corner, leaf) and onTile(tile, isActive) for all leaves and tiles.
  template <class OnLeaf, class OnTile>
  void visit(OnLeaf&& onLeaf, OnTile&& onTile) const {
    for (std::uint32_t i = 0; i < root_->data()->mTableSize; ++i) {
      const auto& tile = *root_->data()->tile(i);
      const auto origin = tile.origin();
      const Coord corner{origin[0], origin[1], origin[2]};
      if (tile.isChild())
        visitUpper(*node<Upper>(root_, tile.child), corner, onLeaf, onTile);
      else
        onTile({corner, kUpperExtent, double(tile.value)}, tile.state != 0);
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
        onTile({at, kLowerExtent, double(data.mTable[n].value)}, data.mValueMask.isOn(n));
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
        onTile({at, kBrickSide, double(data.mTable[n].value)}, data.mValueMask.isOn(n));
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

/// Access to the leaves of NanoVDB for buildVolume. Their voxels are in voxelOffset order.
template <class Leaf>
struct NanoLeafAccess {
  static auto value(const Leaf& leaf, int i) { return leaf.data()->getValue(std::uint32_t(i)); }
  static BrickMask mask(const Leaf& leaf) {
    BrickMask mask;
    for (int i = 0; i < kBrickVoxels; ++i)
      if (leaf.data()->mValueMask.isOn(std::uint32_t(i))) mask.set(i);
    return mask;
  }
};

template <class Build>
std::uint64_t countBricks(const NanoTree<Build>& tree, const ReadOptions& options) {
  std::uint64_t bricks = 0;
  const auto add = [&](std::int32_t extent) {
    const auto side = std::uint64_t(extent / kBrickSide);
    bricks += side * side * side;
    refuseTooLarge(bricks, options);
  };
  tree.visit([&](Coord, const auto&) { add(kBrickSide); },
             [&](const TileSource& tile, bool isActive) {
               if (isActive) add(tile.extent);
             });
  return bricks;
}

template <class Build>
std::vector<Coord> brickCorners(const NanoTree<Build>& tree, const ReadOptions& options) {
  std::vector<Coord> corners;
  corners.reserve(countBricks(tree, options));
  tree.visit(
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
constexpr bool kHasExactValues = std::is_floating_point_v<Build>;

template <class Build>
void readVoxelsAs(const NanoBuffer& buffer, const ReadOptions& options, VolumeGrid& grid) {
  using Leaf = typename NanoTree<Build>::Leaf;
  using Access = NanoLeafAccess<Leaf>;
  const NanoTree<Build> tree(buffer);
  grid.descriptor.background = tree.background();
  const FillRules rules{narrowBackground(tree.background()),
                        grid.descriptor.gridClass == GridClass::kLevelSet,
                        options.nonFinite,
                        options.nonFiniteValue,
                        options.allowEmpty,
                        kHasExactValues<Build>};
  auto corners = brickCorners(tree, options);
  SparseVolume& volume = grid.volume = layOutBricks(corners, rules, options.memory);
  FillTallies tallies{{.replacement = rules.replacement()},
                      InactiveCounter(tree.background(), rules.levelSet)};
  tree.visit(
      [&](Coord corner, const Leaf& leaf) {
        if (Access::mask(leaf).count() == 0)
          countInactiveLeaf(leaf, Access{}, rules, corner, tallies);
        else
          fillFromLeaf(leaf, Access{}, rules, brickAt(volume, corner), volume, tallies);
      },
      [&](const TileSource& tile, bool isActive) {
        if (isActive)
          fillTile(tile, volume, tallies.nonFinite);
        else
          tallies.inactive.tile(tile);
      });
  refuseNonFinite(tallies.nonFinite, rules.nonFinite);
  grid.nonFiniteReplaced = tallies.nonFinite.count;
  grid.inactive = tallies.inactive.lostIn(volume);
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

}  // namespace

std::string nanoValueType(std::uint32_t gridType) {
  constexpr std::array kNames{"unknown", "float", "double", "int16",  "int32", "int64", "vec3s",
                              "vec3d",   "mask",  "half",   "uint32", "bool",  "rgba8", "fp4",
                              "fp8",     "fp16",  "fpn",    "vec4s",  "vec4d", "index"};
  return gridType < kNames.size() ? kNames[gridType] : "number " + std::to_string(gridType);
}

bool isScalarFloatNano(std::uint32_t gridType) {
  using Type = nanovdb::GridType;
  const auto type = Type(gridType);
  return type == Type::Float || type == Type::Double || type == Type::Fp4 || type == Type::Fp8 ||
         type == Type::Fp16 || type == Type::FpN;
}

VolumeGrid readNanoVoxels(const NanoBuffer& buffer, std::uint32_t gridType, GridClass gridClass,
                          const ReadOptions& options) {
  using Type = nanovdb::GridType;
  VolumeGrid grid;
  grid.descriptor.gridClass = gridClass;
  grid.descriptor.valueType =
      Type(gridType) == Type::Double ? ValueType::kDouble : ValueType::kFloat;
  switch (Type(gridType)) {
    case Type::Float:
      readVoxelsAs<float>(buffer, options, grid);
      break;
    case Type::Double:
      readVoxelsAs<double>(buffer, options, grid);
      break;
    case Type::Fp4:
      readVoxelsAs<nanovdb::Fp4>(buffer, options, grid);
      break;
    case Type::Fp8:
      readVoxelsAs<nanovdb::Fp8>(buffer, options, grid);
      break;
    case Type::Fp16:
      readVoxelsAs<nanovdb::Fp16>(buffer, options, grid);
      break;
    case Type::FpN:
      readVoxelsAs<nanovdb::FpN>(buffer, options, grid);
      break;
    default:
      throw BadInput("its values are of type " + nanoValueType(gridType));
  }
  grid.descriptor.transform = transformOf(buffer);
  return grid;
}

}  // namespace esvr::vdb
