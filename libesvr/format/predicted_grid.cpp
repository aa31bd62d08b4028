#include "format/predicted_grid.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "esvr/error.h"
#include "format/byte_reader.h"
#include "format/byte_writer.h"
#include "format/grid_record.h"
#include "format/predicted_stream.h"
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

std::vector<std::byte> recordOf(const StoredGrid& grid) {
  ByteWriter record;
  putGrid(record, grid, {});
  return record.take();
}

std::uint32_t equalBytes(std::span<const std::byte> a, std::span<const std::byte> b) {
  const auto end = std::mismatch(a.begin(), a.end(), b.begin(), b.end()).first;
  return std::uint32_t(end - a.begin());
}

std::uint32_t equalBytesAtEnd(std::span<const std::byte> a, std::span<const std::byte> b) {
  const auto end = std::mismatch(a.rbegin(), a.rend(), b.rbegin(), b.rend()).first;
  return std::uint32_t(end - a.rbegin());
}

/// Writes the bytes of a record between those that the previous record begins and ends with too.
void putRecord(ByteWriter& out, std::span<const std::byte> record,
               std::span<const std::byte> previous) {
  const std::uint32_t first = equalBytes(record, previous);
  const std::uint32_t last = equalBytesAtEnd(record.subspan(first), previous.subspan(first));
  out.put(first);
  out.put(last);
  out.putSized(record.subspan(first, record.size() - first - last));
}

std::vector<std::byte> getRecord(ByteReader& in, std::span<const std::byte> previous) {
  const auto first = in.get<std::uint32_t>(), last = in.get<std::uint32_t>();
  if (std::uint64_t(first) + last > previous.size())
    in.fail("more bytes of the previous frame's record than it has");
  const auto middle = in.getSized();
  std::vector<std::byte> record(previous.begin(), previous.begin() + first);
  record.insert(record.end(), middle.begin(), middle.end());
  record.insert(record.end(), previous.end() - last, previous.end());
  return record;
}

StoredGrid gridOf(std::span<const std::byte> record, const std::string& where) {
  ByteReader in(record, where);
  GridRecord grid = getGrid(in);
  in.finish();
  if (grid.chunkCount != 0) in.fail("a predicted grid has ellipsoids");
  return std::move(grid.grid);
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
  putRecord(out, recordOf(grid), recordOf(previous));
  putHead(out, *grid.voxels, *previous.voxels);
  const codec::PastVoxels past(*previous.voxels, *grid.voxels);
  out.putAll(encodePredicted(*grid.voxels, past));
  return out.take();
}

StoredGrid getPredicted(std::span<const std::byte> content, const std::string& where,
                        const StoredGrid& previous, MemoryBudget& budget) {
  if (!previous.voxels) throw BadInput(where + ": the grid of the previous frame has no voxels");
  ByteReader in(content, where);
  StoredGrid grid = gridOf(getRecord(in, recordOf(previous)), where);
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
