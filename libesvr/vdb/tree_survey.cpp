#include "vdb/tree_survey.h"

#include "vdb/tree_walk.h"

namespace esvr::vdb {
namespace {

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

TreeSurvey surveyTree(InputFile& file, const ValueLayout& layout) {
  Surveyor surveyor;
  TreeWalk walk(file, layout, surveyor);
  walk.topology();
  for (std::uint64_t i = 0; i < surveyor.survey.leaves; ++i) walk.leafValues();
  return surveyor.survey;
}

}  // namespace esvr::vdb
