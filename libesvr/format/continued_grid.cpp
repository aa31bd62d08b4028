#include "format/continued_grid.h"

#include <numeric>
#include <utility>

#include "esvr/error.h"
#include "format/byte_reader.h"
#include "format/byte_writer.h"
#include "format/continued_section.h"
#include "format/level_section.h"
#include "format/mask_section.h"
#include "format/record_difference.h"
#include "format/validity.h"

namespace esvr::format {
namespace {

/// True if the ellipsoids of a grid can be continued: they are quantised, and in one chunk.
bool hasOneQuantisedChunk(const StoredGrid& grid) {
  return grid.field.chunks.size() == 1 && grid.quantised.size() == 1;
}

/// True if a grid is its record, its ellipsoids and perhaps a mask or levels.
bool hasEllipsoidsOnly(const StoredGrid& grid) {
  return hasOneQuantisedChunk(grid) && !grid.residual && !grid.voxels &&
         grid.topology != TopologyKind::kBricks && grid.layerErrors.empty() && grid.curve.empty();
}

bool sameCodes(const QuantisedEllipsoids& a, const QuantisedEllipsoids& b) {
  return a.lattice == b.lattice && a.position == b.position && a.precision == b.precision &&
         a.scale == b.scale && a.rotation == b.rotation && a.intensity == b.intensity;
}

/// The ellipsoids of a frame. If they are those of the previous one, each of them continues itself.
QuantisedEllipsoids continuing(const QuantisedEllipsoids& q, const QuantisedEllipsoids& before) {
  QuantisedEllipsoids result = q;
  if (!sameCodes(q, before)) return result;
  result.layerEnds.clear();
  result.continues.resize(q.size());
  std::iota(result.continues.begin(), result.continues.end(), 0u);
  return result;
}

/// The mask of a grid; without bricks if it has none.
Mask maskOf(const StoredGrid& grid) {
  if (grid.topology != TopologyKind::kMask) return {};
  return {grid.bricks, grid.mask};
}

/// The levels of a grid; without bricks if it has none.
Levels levelsOf(const StoredGrid& grid) {
  if (grid.topology != TopologyKind::kBlocks) return {};
  return {grid.bricks, grid.levels};
}

void putTopology(ByteWriter& out, const StoredGrid& grid, const StoredGrid& previous) {
  if (grid.topology == TopologyKind::kMask)
    out.putSized(putMaskAfter(grid.bricks, grid.mask, maskOf(previous)));
  if (grid.topology == TopologyKind::kBlocks)
    out.putSized(putLevels(levelsOf(grid), levelsOf(previous)));
}

void getMaskOf(ByteReader& in, const std::string& where, const StoredGrid& previous,
               MemoryBudget& budget, StoredGrid& grid) {
  Mask mask = getMaskAfter(in.getSized(), where, maskOf(previous), budget);
  grid.bricks = std::move(mask.bricks);
  grid.mask = std::move(mask.active);
}

void getLevelsOf(ByteReader& in, const std::string& where, const StoredGrid& previous,
                 MemoryBudget& budget, StoredGrid& grid) {
  Levels levels = getLevels(in.getSized(), where, levelsOf(previous), budget);
  grid.bricks = std::move(levels.bricks);
  grid.levels = std::move(levels.levels);
}

void getTopology(ByteReader& in, const std::string& where, const StoredGrid& previous,
                 MemoryBudget& budget, StoredGrid& grid) {
  if (grid.topology == TopologyKind::kBricks) in.fail("a narrow band continues no ellipsoids");
  if (grid.topology == TopologyKind::kMask) getMaskOf(in, where, previous, budget, grid);
  if (grid.topology == TopologyKind::kBlocks) getLevelsOf(in, where, previous, budget, grid);
}

}  // namespace

std::optional<std::vector<std::byte>> putContinuedGrid(const StoredGrid& grid,
                                                       const StoredGrid& previous) {
  if (!hasEllipsoidsOnly(grid) || !hasOneQuantisedChunk(previous) ||
      grid.field.chunks[0].origin != previous.field.chunks[0].origin)
    return std::nullopt;
  const QuantisedEllipsoids& before = previous.quantised[0];
  const QuantisedEllipsoids q = continuing(grid.quantised[0], before);
  if (!canContinue(q, before) || !canFollow(maskOf(grid), maskOf(previous))) return std::nullopt;
  ByteWriter out;
  putRecordAfter(out, grid, previous);
  putTopology(out, grid, previous);
  out.putAll(putContinued(q, before));
  return out.take();
}

StoredGrid getContinuedGrid(std::span<const std::byte> content, const std::string& where,
                            const StoredGrid& previous, MemoryBudget& budget) {
  if (!hasOneQuantisedChunk(previous))
    throw BadInput(where + ": the grid of the previous frame has no ellipsoids that go on");
  ByteReader in(content, where);
  StoredGrid grid = getRecordAfter(in, previous, where);
  getTopology(in, where, previous, budget, grid);
  grid.quantised.push_back(
      getContinued(in.getBytes(in.left()), where, previous.quantised[0], budget));
  grid.field.chunks.push_back({previous.field.chunks[0].origin, dequantise(grid.quantised[0])});
  if (const auto fault = faultOf(grid.field.chunks[0].ellipsoids)) in.fail(fault->text);
  return grid;
}

}  // namespace esvr::format
