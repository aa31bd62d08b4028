#include "vdb/tree_walk.h"

#include <string_view>

namespace esvr::vdb {
namespace {

/// A type of values, and the bytes of a number and the count of numbers in it.
struct KnownType {
  std::string_view name;
  std::uint64_t numberBytes = 0, numbers = 1;
  bool canBeHalf = false;  ///< OpenVDB stores the others as they are if half floats are asked for
  ValueLayout::Leaves leaves = ValueLayout::Leaves::kBlocks;
};

constexpr auto kOther = ValueLayout::Leaves::kOther, kFixed = ValueLayout::Leaves::kFixed;
constexpr std::array kKnownTypes{
    KnownType{"float", 4, 1, true},
    KnownType{"double", 8, 1, true},
    KnownType{"half", 2},  // HalfGrid of OpenVDB 13
    KnownType{"vec2s", 4, 2, true},
    KnownType{"vec2d", 8, 2, true},
    KnownType{"vec3s", 4, 3, true},
    KnownType{"vec3d", 8, 3, true},
    KnownType{"int32", 4},
    KnownType{"uint32", 4},
    KnownType{"int64", 8},
    KnownType{"vec2i", 4, 2},
    KnownType{"vec3i", 4, 3},
    KnownType{"vec4i", 4, 4},
    KnownType{"vec4s", 4, 4},
    KnownType{"vec4d", 8, 4},
    KnownType{"bool", 1, 1, false, kFixed},
    KnownType{"mask", 1, 1, false, kFixed},
    KnownType{"ptidx32", 4, 1, false, kOther},
    KnownType{"ptdataidx32", 4, 1, false, kOther},
};

/// Bytes of a leaf of bits: its mask, its place and, unless the mask is the value, its values.
constexpr std::uint64_t kMaskLeafBytes = sizeof(LeafMask) + sizeof(Coord);
constexpr std::uint64_t kBoolLeafBytes = kMaskLeafBytes + sizeof(LeafMask);

/// Counts the leaves of a tree.
struct LeafCounter {
  void leaf(Coord, const LeafMask&) { ++leaves; }
  void rootTile(Coord, std::uint64_t, bool) {}
  template <int kLog2>
  void tiles(const NodeCells<NodeMask<kLog2>>&, std::int32_t) {}

  std::uint64_t leaves = 0;
};

/// Adds up what a tree holds.
class Surveyor {
 public:
  void leaf(Coord corner, const LeafMask& mask) {
    ++survey.leaves;
    survey.activeVoxels += mask.count();
    mask.forEachSet([&](std::size_t n) { survey.activeBox.expand(corner + voxelLocal(int(n))); });
  }

  void rootTile(Coord corner, std::uint64_t, bool isActive) {
    if (isActive) tile(corner, kUpperExtent);
  }

  template <int kLog2>
  void tiles(const NodeCells<NodeMask<kLog2>>& cells, std::int32_t extent) {
    cells.active.forEachSet(
        [&](std::size_t n) { tile(cellCorner<kLog2>(cells.corner, n, extent), extent); });
  }

  TreeSurvey survey;

 private:
  void tile(Coord corner, std::int32_t extent) {
    const auto bricksASide = std::uint64_t(extent / kBrickSide);
    const std::uint64_t bricks = bricksASide * bricksASide * bricksASide;
    survey.tileBricks += bricks;
    survey.activeVoxels += bricks * kBrickVoxels;
    const std::int32_t last = extent - 1;
    survey.activeBox.expand(Box{corner, corner + Coord{last, last, last}});
  }
};

}  // namespace

std::optional<ValueLayout> layoutOf(const StoredTree& tree) {
  constexpr std::string_view kTreePrefix = "Tree_", kUsualNodes = "_5_4_3";
  std::string_view name = tree.treeType;
  if (!name.starts_with(kTreePrefix) || !name.ends_with(kUsualNodes)) return std::nullopt;
  name.remove_prefix(kTreePrefix.size());
  name.remove_suffix(std::min(kUsualNodes.size(), name.size()));
  const auto* const type = std::ranges::find(kKnownTypes, name, &KnownType::name);
  if (type == kKnownTypes.end()) return std::nullopt;
  constexpr std::uint64_t kHalfBytes = 2;
  ValueLayout layout{.valueBytes = type->numberBytes * type->numbers,
                     .halfBytes = type->numbers * kHalfBytes,
                     .savedAsHalf = tree.savedAsHalf && type->canBeHalf,
                     .compression = tree.compression,
                     .leaves = type->leaves};
  if (type->leaves != ValueLayout::Leaves::kFixed) return layout;
  layout.leafBytes = type->name == "mask" ? kMaskLeafBytes : kBoolLeafBytes;
  return layout;
}

TreeExtent extentOfTree(InputFile& file, const ValueLayout& layout) {
  LeafCounter counter;
  TreeWalk walk(file, layout, counter);
  walk.topology();
  TreeExtent extent{.valuesAt = file.position()};
  if (layout.leaves == ValueLayout::Leaves::kOther && counter.leaves > 0) return extent;
  for (std::uint64_t i = 0; i < counter.leaves; ++i) walk.leafValues();
  extent.end = file.position();
  return extent;
}

TreeSurvey surveyTree(InputFile& file, const ValueLayout& layout) {
  Surveyor surveyor;
  TreeWalk walk(file, layout, surveyor);
  walk.topology();
  for (std::uint64_t i = 0; i < surveyor.survey.leaves; ++i) walk.leafValues();
  return surveyor.survey;
}

}  // namespace esvr::vdb
