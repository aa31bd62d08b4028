#include "format/predicted_grid.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "esvr/error.h"
#include "format/byte_reader.h"
#include "format/byte_writer.h"
#include "format/predicted_stream.h"
#include "format/record_difference.h"
#include "format/voxel_section.h"

namespace esvr::format {
namespace {

/// Whether a layer has the head of the previous frame's.
enum class LayerHead : std::uint8_t { kOwn = 0, kSame = 1 };

/// True if a grid is its record and its voxels.
bool hasVoxelsOnly(const StoredGrid& grid) {
  return grid.voxels && !grid.residual && grid.topology == TopologyKind::kThreshold &&
         grid.field.chunks.empty() && grid.layerErrors.empty() && grid.curve.empty();
}

/// Writes the head of a layer, unless it is that of the previous frame.
void putHead(ByteWriter& out, const VoxelLayer& layer, const VoxelLayer& previous) {
  ByteWriter head, before;
  putVoxelHead(head, layer);
  putVoxelHead(before, previous);
  const bool same = std::ranges::equal(head.bytes(), before.bytes());
  out.put(std::uint8_t(same ? LayerHead::kSame : LayerHead::kOwn));
  if (!same) out.putAll(head.bytes());
}

VoxelLayer getHead(ByteReader& in, const VoxelLayer& previous) {
  if (in.getEnum(LayerHead::kSame, "head of voxels") == LayerHead::kOwn) return getVoxelHead(in);
  VoxelLayer layer;
  layer.form = previous.form;
  layer.divisor = previous.divisor;
  layer.palette = previous.palette;
  layer.origin = previous.origin;
  layer.background = previous.background;
  return layer;
}

/// Largest number of bricks of a frame: the previous frame, its neighbours and the stream limit it.
constexpr auto kAnyBricks = std::numeric_limits<std::uint64_t>::max();

}  // namespace

std::optional<std::vector<std::byte>> putPredicted(const StoredGrid& grid,
                                                   const StoredGrid& previous) {
  if (!hasVoxelsOnly(grid) || !previous.voxels ||
      !codec::isPredictable(*grid.voxels, *previous.voxels))
    return std::nullopt;
  ByteWriter out;
  putRecordAfter(out, grid, previous);
  putHead(out, *grid.voxels, *previous.voxels);
  const codec::PastVoxels past(*previous.voxels, *grid.voxels);
  out.putAll(encodePredicted(*grid.voxels, past));
  return out.take();
}

StoredGrid getPredicted(std::span<const std::byte> content, const std::string& where,
                        const StoredGrid& previous, MemoryBudget& budget) {
  if (!previous.voxels) throw BadInput(where + ": the grid of the previous frame has no voxels");
  ByteReader in(content, where);
  StoredGrid grid = getRecordAfter(in, previous, where);
  VoxelLayer layer = getHead(in, *previous.voxels);
  layer.codes = VoxelArray<std::int32_t>(budget.voxels());
  if (!codec::isPredictable(layer, *previous.voxels))
    in.fail("lies too far from the previous frame");
  try {
    const codec::PastVoxels past(*previous.voxels, layer);
    decodePredicted(in, past, kAnyBricks, {where, budget}, layer);
  } catch (const BadInput& error) {
    in.fail(error.what());
  }
  checkVoxels(layer, in);
  grid.voxels = std::move(layer);
  return grid;
}

}  // namespace esvr::format
