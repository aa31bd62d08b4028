// Sections of voxels that are coded with other voxels as context.

#include "format/predicted_sections.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "codec/brick_coder.h"
#include "codec/frame_coder.h"
#include "codec/past_voxels.h"
#include "esvr/error.h"
#include "format/bytes.h"
#include "format/records.h"
#include "format/voxel_section.h"

namespace esvr::format {

// ---- The stream of a layer

namespace {

/// The number of bricks that the context has not.
std::uint64_t newBricks(const VoxelLayer& layer, const codec::PastVoxels& past) {
  return std::uint64_t(std::ranges::count_if(
      layer.bricks, [&](const Coord brick) { return past.find(brick) == BrickIndex::kNone; }));
}

std::vector<std::byte> encodePredicted(const VoxelLayer& layer, const codec::PastVoxels& past) {
  codec::Writer writer;
  VoxelLayer written = layer;
  codec::codeFrameBricks(writer, past, written.bricks);
  codec::codeFrameVoxels(writer, codec::codingOrder(written.bricks), past, written);
  auto stream = writer.coder.finish();
  stream.resize(std::max<std::uint64_t>(stream.size(), bytesForBricks(newBricks(layer, past))));
  return stream;
}

/// Where the memory of a reader comes from, and the start of its error texts.
struct ReaderPlace {
  const std::string& where;
  MemoryBudget& budget;
};

/// Reads the bricks and the voxels of a layer from the rest of a section.
/// \param maxBricks  largest number of bricks
/// \throws BadInput  the stream is damaged
/// \throws MemoryExceeded  there are more bricks than the budget allows
void decodePredicted(ByteReader& in, const codec::PastVoxels& past, std::uint64_t maxBricks,
                     const ReaderPlace& place, VoxelLayer& layer) {
  const auto stream = in.getBytes(in.left());
  codec::Reader reader{codec::RangeDecoder(stream)};
  codec::codeFrameBricks(reader, past, maxBricksIn(stream.size()), layer.bricks);
  if (layer.bricks.size() > maxBricks) in.fail("more bricks of voxels than its bytes can hold");
  checkBricks(layer, in);
  takeBricks(layer.bricks.size(), place.where, place.budget);
  layer.codes.resize(layer.bricks.size() * kBrickVoxels);
  layer.active.resize(layer.bricks.size());
  layer.vacant.resize(layer.bricks.size());
  codec::codeFrameVoxels(reader, codec::codingOrder(layer.bricks), past, layer);
}

}  // namespace

// ---- The difference from the previous frame

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

// ---- Related voxels

namespace {

/// What a section has of the head of its voxels.
enum class RelatedHead : std::uint8_t {
  kOwn = 0,     ///< all of it
  kDivisor = 1  ///< the divisor; the form is kQuantised, the rest is that of the reference
};

codec::ValueMap mapOf(const VoxelReference& reference) {
  return {double(reference.gain), double(reference.offset)};
}

/// A layer without bricks where the given one is.
VoxelLayer emptyAt(const VoxelLayer& layer) {
  VoxelLayer empty;
  empty.origin = layer.origin;
  return empty;
}

/// The part of a head that a section need not repeat, besides the background.
bool sharesHead(const VoxelLayer& layer, const VoxelLayer& of) {
  const auto bits = [](float value) { return std::bit_cast<std::uint32_t>(value); };
  return layer.form == VoxelForm::kQuantised && layer.palette.empty() &&
         layer.origin == of.origin && bits(layer.background) == bits(of.background);
}

void putReference(ByteWriter& out, const VoxelReference& reference) {
  putVarint(out, reference.grid ? std::uint64_t(*reference.grid) + 1 : 0);
  if (!reference.grid) return;
  out.put(reference.gain);
  out.put(reference.offset);
}

std::optional<std::size_t> getReferenced(ByteReader& in) {
  const std::uint64_t number = getVarint(in);
  if (number == 0) return std::nullopt;
  return std::size_t(number - 1);
}

VoxelReference getReference(ByteReader& in) {
  VoxelReference reference{getReferenced(in)};
  if (!reference.grid) return reference;
  reference.gain = in.get<float>();
  reference.offset = in.get<float>();
  if (!std::isfinite(reference.gain) || !std::isfinite(reference.offset))
    in.fail("the gain or the offset of a reference is not finite");
  return reference;
}

void putRelatedHead(ByteWriter& out, const VoxelLayer& layer, const VoxelLayer* of) {
  const bool shares = of && sharesHead(layer, *of);
  out.put(std::uint8_t(shares ? RelatedHead::kDivisor : RelatedHead::kOwn));
  if (shares)
    out.put(layer.divisor);
  else
    putVoxelHead(out, layer);
}

VoxelLayer getRelatedHead(ByteReader& in, const VoxelLayer* of) {
  if (in.getEnum(RelatedHead::kDivisor, "head of voxels") == RelatedHead::kOwn)
    return getVoxelHead(in);
  if (!of) in.fail("a head of voxels without a reference");
  VoxelLayer layer;
  layer.form = VoxelForm::kQuantised;
  layer.origin = of->origin;
  layer.background = of->background;
  layer.divisor = getDivisor(in);
  return layer;
}

/// The layer that a reference names; null if it names none.
const VoxelLayer* referencedLayer(const VoxelReference& reference,
                                  std::span<const StoredGrid> before, const ByteReader& in) {
  if (!reference.grid) return nullptr;
  const std::string name = "it refers to grid " + std::to_string(*reference.grid);
  if (*reference.grid >= before.size()) in.fail(name + ", which is not before it");
  const StoredGrid& grid = before[*reference.grid];
  if (!grid.voxels) in.fail(name + ", which has no voxels");
  return &*grid.voxels;
}

}  // namespace

std::optional<std::vector<std::byte>> putRelated(const VoxelLayer& layer,
                                                 const VoxelReference& reference,
                                                 const VoxelLayer* of) {
  const VoxelLayer empty = emptyAt(layer);
  const VoxelLayer& context = of ? *of : empty;
  if (!codec::isPredictable(layer, context)) return std::nullopt;
  ByteWriter out;
  putReference(out, reference);
  putRelatedHead(out, layer, of);
  out.putAll(encodePredicted(layer, codec::PastVoxels(context, layer, mapOf(reference))));
  return out.take();
}

std::optional<std::size_t> referenceIn(std::span<const std::byte> begin, const std::string& where) {
  ByteReader in(begin, where);
  return getReferenced(in);
}

void getRelated(std::span<const std::byte> content, const std::string& where,
                std::span<const StoredGrid> before, MemoryBudget& budget, StoredGrid& grid) {
  ByteReader in(content, where);
  const VoxelReference reference = getReference(in);
  const VoxelLayer* of = referencedLayer(reference, before, in);
  VoxelLayer layer = getRelatedHead(in, of);
  layer.codes = VoxelArray<std::int32_t>(budget.voxels());
  const VoxelLayer empty = emptyAt(layer);
  const VoxelLayer& context = of ? *of : empty;
  if (!codec::isPredictable(layer, context)) in.fail("lies too far from the grid it refers to");
  const std::uint64_t maxBricks = maxBricksIn(content.size()) + context.bricks.size();
  try {
    const codec::PastVoxels past(context, layer, mapOf(reference));
    decodePredicted(in, past, maxBricks, {where, budget}, layer);
  } catch (const BadInput& error) {
    in.fail(error.what());
  }
  checkVoxels(layer, in);
  // Copies of a grid with another background could have such voxels; no writer makes them.
  if (!codec::isPredictable(layer, context)) in.fail("a vacant voxel is not the background");
  grid.voxels = std::move(layer);
  grid.reference = reference;
}

}  // namespace esvr::format
