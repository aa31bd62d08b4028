#include "format/related_voxels.h"

#include <bit>
#include <cmath>
#include <utility>

#include "codec/past_voxels.h"
#include "esvr/error.h"
#include "format/byte_reader.h"
#include "format/byte_writer.h"
#include "format/predicted_stream.h"
#include "format/varint.h"
#include "format/voxel_section.h"

namespace esvr::format {
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
