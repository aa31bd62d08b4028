// Sections of voxels: where they are active, layers of values, and layers that are coded with other voxels as context.

#include "format/voxel_sections.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "codec/brick_coder.h"
#include "codec/frame_coder.h"
#include "codec/voxel_coder.h"
#include "core/counted.h"
#include "core/geometry.h"
#include "esvr/error.h"
#include "format/records.h"

namespace esvr::format {

// ---- Positions of bricks

namespace {

constexpr std::size_t kBrickBytes = 3 * sizeof(std::int32_t);

constexpr std::int32_t kBrickMin = Box::kMin / kBrickSide, kBrickMax = Box::kMax / kBrickSide;

bool validSuccessor(Coord corner, const Coord* previous) {
  return localOf(corner) == Coord{} && (!previous || *previous < corner);
}

void requireBricks(std::span<const Coord> corners) {
  for (std::size_t i = 0; i < corners.size(); ++i)
    if (!validSuccessor(corners[i], i == 0 ? nullptr : &corners[i - 1]))
      throw RuntimeFailure("brick corner " + toString(corners[i]) +
                           " is not a multiple of 8 or not above the one before it");
}

}  // namespace

std::vector<std::byte> putBricks(std::span<const Coord> corners) {
  requireBricks(corners);
  ByteWriter out;
  for (const auto axis : kAxes)
    for (const Coord& corner : corners) out.put(brickOf(corner).*axis);
  return out.take();
}

std::vector<Coord> getBricks(std::span<const std::byte> content, const std::string& where) {
  ByteReader in(content, where);
  if (content.size() % kBrickBytes != 0) in.fail("not a whole number of bricks");
  std::vector<Coord> corners(content.size() / kBrickBytes);
  for (const auto axis : kAxes) {
    for (Coord& corner : corners) {
      const auto brick = in.get<std::int32_t>();
      if (brick < kBrickMin || brick > kBrickMax) in.fail("a brick lies outside the index space");
      corner.*axis = brick * kBrickSide;
    }
  }
  for (std::size_t i = 1; i < corners.size(); ++i)
    if (!(corners[i - 1] < corners[i])) in.fail("brick " + std::to_string(i) + " is out of order");
  return corners;
}

// ---- Masks

namespace {

/// Positions of the bricks relative to the origin. Corners may be 2^32 voxels apart; as a number of
/// bricks this difference fits into 32 bits.
std::vector<Coord> bricksFrom(Coord origin, std::span<const Coord> corners) {
  std::vector<Coord> bricks;
  for (const Coord corner : corners) bricks.push_back(brickOf(corner) - brickOf(origin));
  return bricks;
}

BrickMask inverse(BrickMask mask) {
  for (auto& word : mask.words) word = ~word;
  return mask;
}

Mask maskOf(VoxelLayer layer) {
  Mask mask;
  for (const Coord brick : layer.bricks) mask.bricks.push_back(layer.origin + brick * kBrickSide);
  mask.active = std::move(layer.active);
  return mask;
}

}  // namespace

/// Stores the mask as a voxel layer with one value, so that only the activity of voxels takes
/// bytes.
std::vector<std::byte> putMask(std::span<const Coord> bricks, std::span<const BrickMask> active) {
  requireBricks(bricks);
  if (bricks.size() != active.size()) throw RuntimeFailure("a mask without its bricks");
  VoxelLayer layer;
  layer.form = VoxelForm::kPalette;
  layer.palette = {0.0f};
  layer.origin = bricks.empty() ? Coord{} : bricks.front();
  for (const Coord brick : bricks) layer.origin = minCoord(layer.origin, brick);
  layer.bricks = bricksFrom(layer.origin, bricks);
  layer.codes.resize(bricks.size() * kBrickVoxels);
  layer.active.assign(active.begin(), active.end());
  for (const BrickMask& mask : active) layer.vacant.push_back(inverse(mask));
  return putVoxels(layer);
}

Mask getMask(std::span<const std::byte> content, const std::string& where, MemoryBudget& budget) {
  VoxelLayer layer = getVoxels(content, where, budget);
  if (layer.form != VoxelForm::kPalette || layer.palette.size() != 1)
    throw BadInput(where + ": a mask of voxels with values");
  return maskOf(std::move(layer));
}

// ---- Layers of voxels

namespace {

/// Limit on the number of bricks in a byte, so that a reader knows it before it allocates memory.
/// The writer adds zeros where there would be more.
constexpr std::uint64_t kMaxBricksPerByte = 4;

/// Bytes of memory that a brick takes while it is read: its codes, its masks, and its values.
constexpr std::uint64_t kCodeBytesPerBrick = kBrickVoxels * sizeof(std::int32_t);
constexpr double kVoxelBytesPerBrick = double(kCodeBytesPerBrick) + kBrickVoxels * sizeof(float);
constexpr double kEntryBytesPerBrick = 3.0 * sizeof(BrickMask) + 64.0;

int bitsOf(const std::vector<Coord>& bricks) {
  std::uint32_t all = 0;
  for (const Coord b : bricks) all |= std::uint32_t(b.x) | std::uint32_t(b.y) | std::uint32_t(b.z);
  const int bits = std::bit_width(all);
  if (bits > kMaxBrickBits)
    throw RuntimeFailure("cannot store voxels: the grid's bricks lie too far apart");
  return bits;
}

/// Largest number of bricks that a section may have without a previous frame, so that a reader knows it before it
/// allocates memory.
std::uint64_t maxBricksIn(std::uint64_t bytes) {
  return kMaxBricksPerByte * bytes + kMaxBricksPerByte - 1;
}

/// The number of bytes that a section needs for bricks that the previous frame has not.
std::uint64_t bytesForBricks(std::uint64_t bricks) {
  return (bricks + kMaxBricksPerByte - 1) / kMaxBricksPerByte;
}

/// Refuses bricks that reach out of the index space.
void checkBricks(const VoxelLayer& layer, const ByteReader& in) {
  const auto beyond = [](std::int32_t origin, std::int32_t brick) {
    return std::int64_t(origin) + std::int64_t(brick + 1) * kBrickSide - 1 > Box::kMax;
  };
  for (const Coord b : layer.bricks)
    if (beyond(layer.origin.x, b.x) || beyond(layer.origin.y, b.y) || beyond(layer.origin.z, b.z))
      in.fail("a brick of voxels lies outside the index space");
}

/// Refuses codes without a value, and values that are not finite.
void checkVoxels(const VoxelLayer& layer, const ByteReader& in) {
  if (layer.form == VoxelForm::kPalette)
    for (const auto code : layer.codes)
      if (code < 0 || std::uint32_t(code) >= layer.palette.size())
        in.fail("a voxel is not in the palette");
  if (!allFinite(layer)) in.fail("a voxel is not finite");
}

void setBricks(std::span<const std::uint64_t> keys, const ByteReader& in, VoxelLayer& layer) {
  for (const auto key : keys) layer.bricks.push_back(codec::brickAt(key));
  std::sort(layer.bricks.begin(), layer.bricks.end());
  if (std::adjacent_find(layer.bricks.begin(), layer.bricks.end()) != layer.bricks.end())
    in.fail("a brick of voxels is there twice");
  checkBricks(layer, in);
}

template <class Side>
void codeModel(Side& side, Coded<Side, codec::VoxelModel>& model) {
  code(side, model.vacantCode);
  for (auto& mirror : model.mirror) {
    code(side, mirror);
    if constexpr (Side::kReads)
      if (mirror < codec::VoxelModel::kNoMirror) side.fail("a mirror of voxels");
  }
  auto common = std::uint8_t(model.common.size());
  code(side, common);
  if constexpr (Side::kReads) {
    if (common > codec::VoxelModel::kMaxCommon) side.fail("too many common voxels");
    model.common.resize(common);
  }
  for (auto& voxel : model.common) code(side, voxel);
}

template <class Side>
void codeDivisor(Side& side, Coded<Side, double>& divisor) {
  code(side, divisor);
  if constexpr (Side::kReads)
    if (!(std::isfinite(divisor) && divisor > 0.0)) side.fail("the divisor of voxels");
}

template <class Side>
void codeHead(Side& side, Coded<Side, VoxelLayer>& layer) {
  codeEnum(side, layer.form, VoxelForm::kPalette, "form of voxels");
  codeDivisor(side, layer.divisor);
  codeCoord(side, layer.origin);
  code(side, layer.background);
  auto values = std::uint32_t(layer.palette.size());
  code(side, values);
  if constexpr (Side::kReads) {
    if (localOf(layer.origin) != Coord{}) side.fail("the origin of voxels is not a brick's corner");
    if (!std::isfinite(layer.background)) side.fail("the background of voxels is not finite");
    if (values > side.left() / sizeof(float)) side.fail("ends within the palette of voxels");
    layer.palette.resize(values);
  }
  for (auto& value : layer.palette) code(side, value);
}

struct BrickCount {
  std::uint64_t bricks = 0;
  int bits = 0;
};

BrickCount getBrickCount(ByteReader& in, std::uint64_t bytes) {
  BrickCount count{in.get<std::uint64_t>(), 0};
  if (count.bricks > maxBricksIn(bytes))
    in.fail(counted(bytes, "byte") + " of content for " + counted(count.bricks, "brick"));
  count.bits = in.get<std::uint8_t>();
  if (count.bits > kMaxBrickBits) in.fail("bricks of voxels lie too far apart");
  return count;
}

/// The streams of a layer. All but the last are preceded by their sizes.
std::vector<std::byte> encodeStreams(const VoxelLayer& layer, const codec::VoxelModel& model,
                                     int bits) {
  const auto order = codec::codingOrder(layer.bricks);
  std::vector<std::uint64_t> keys;
  for (const auto b : order) keys.push_back(codec::keyOf(layer.bricks[b]));
  codec::Writer writer;
  codec::CellTree<codec::Writer>(writer).code(keys, 3 * bits);
  auto streams = codec::encodeVoxels(model, layer);
  streams.insert(streams.begin(), writer.coder.finish());
  ByteWriter out;
  for (std::size_t n = 0; n + 1 < streams.size(); ++n) out.put(std::uint32_t(streams[n].size()));
  for (const auto& stream : streams) out.putAll(stream);
  return out.take();
}

std::vector<codec::StreamView> getStreams(ByteReader& in, std::uint64_t count) {
  std::vector<std::uint32_t> sizes;
  if (count - 1 > in.left() / sizeof(std::uint32_t))
    in.fail("ends within the sizes of its streams");
  for (std::uint64_t n = 0; n + 1 < count; ++n) sizes.push_back(in.get<std::uint32_t>());
  std::vector<codec::StreamView> streams;
  for (const std::uint32_t size : sizes) {
    if (size > in.left()) in.fail("ends within a stream of voxels");
    streams.push_back(in.getBytes(size));
  }
  streams.push_back(in.getBytes(in.left()));
  return streams;
}

void decodeStreams(ByteReader& in, const BrickCount& count, const codec::VoxelModel& model,
                   VoxelLayer& layer) {
  const auto streams = getStreams(in, codec::blockCount(count.bricks, model) + 1);
  codec::Reader reader{codec::RangeDecoder(streams.front())};
  std::vector<std::uint64_t> keys(count.bricks);
  try {
    codec::CellTree<codec::Reader>(reader).code(keys, 3 * count.bits);
    setBricks(keys, in, layer);
    layer.codes.resize(count.bricks * kBrickVoxels);
    layer.active.resize(count.bricks);
    layer.vacant.resize(count.bricks);
    codec::decodeVoxels(std::span(streams).subspan(1), model, layer);
  } catch (const BadInput& error) {
    in.fail(error.what());
  }
}

std::vector<std::byte> code(const VoxelLayer& layer) {
  const int bits = bitsOf(layer.bricks);
  codec::VoxelModel model = codec::chooseModel(layer);
  auto stream = encodeStreams(layer, model, bits);
  if (codec::hasMirror(model)) {
    const codec::VoxelModel plain = codec::withoutMirrors(model);
    auto other = encodeStreams(layer, plain, bits);
    if (other.size() < stream.size()) stream = std::move(other), model = plain;
  }
  ByteWriter out;
  codeHead(out, layer);
  out.put(std::uint64_t(layer.bricks.size()));
  out.put(std::uint8_t(bits));
  codeModel(out, model);
  out.putAll(stream);
  out.padTo(std::max<std::uint64_t>(out.size(), bytesForBricks(layer.bricks.size())));
  return out.take();
}

/// The checksum of all members of a layer that its section depends on.
std::uint64_t checksumOf(const VoxelLayer& layer) {
  ByteWriter head;
  codeHead(head, layer);
  RunningChecksum sum;
  sum.add(head.take());
  const auto add = [&](const auto& all) {
    sum.add(std::as_bytes(std::span(all.data(), all.size())));
  };
  add(layer.bricks);
  add(layer.codes);
  add(layer.active);
  add(layer.vacant);
  return sum.value();
}

}  // namespace

VoxelMemory takeBricks(std::uint64_t bricks, const std::string& where, MemoryBudget& budget) {
  return budget.takeVoxels(bricks * kCodeBytesPerBrick, double(bricks) * kVoxelBytesPerBrick,
                           double(bricks) * kEntryBytesPerBrick, where);
}

std::vector<std::byte> putVoxels(const VoxelLayer& layer) {
  const CodedVoxels& coded = layer.coded;
  const bool isCoded = coded.section && coded.checksum == checksumOf(layer);
  return isCoded ? *coded.section : code(layer);
}

std::uint64_t keepCoded(VoxelLayer& layer) {
  auto section = std::make_shared<const std::vector<std::byte>>(putVoxels(layer));
  layer.coded = {checksumOf(layer), std::move(section)};
  return layer.coded.section->size();
}

VoxelLayer getVoxels(std::span<const std::byte> content, const std::string& where,
                     MemoryBudget& budget) {
  ByteReader in(content, where);
  VoxelLayer layer;
  codeHead(in, layer);
  const BrickCount count = getBrickCount(in, content.size());
  layer.codes = VoxelArray<std::int32_t>(takeBricks(count.bricks, where, budget));
  codec::VoxelModel model;
  codeModel(in, model);
  decodeStreams(in, count, model, layer);
  checkVoxels(layer, in);
  return layer;
}

// ---- Layers with other voxels as context

// ---- The stream of a layer

namespace {

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
  layer.codes =
      VoxelArray<std::int32_t>(takeBricks(layer.bricks.size(), place.where, place.budget));
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
  codeHead(head, layer);
  codeHead(before, previous);
  const bool same = std::ranges::equal(head.bytes(), before.bytes());
  out.put(std::uint8_t(same ? LayerHead::kSame : LayerHead::kOwn));
  if (!same) out.putAll(head.bytes());
}

VoxelLayer getHead(ByteReader& in, const VoxelLayer& previous) {
  if (in.getEnum(LayerHead::kSame, "head of voxels") == LayerHead::kSame)
    return codec::headOf(previous);
  VoxelLayer layer;
  codeHead(in, layer);
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
    codeHead(out, layer);
}

VoxelLayer getRelatedHead(ByteReader& in, const VoxelLayer* of) {
  VoxelLayer layer;
  if (in.getEnum(RelatedHead::kDivisor, "head of voxels") == RelatedHead::kOwn) {
    codeHead(in, layer);
    return layer;
  }
  if (!of) in.fail("a head of voxels without a reference");
  layer.form = VoxelForm::kQuantised;
  layer.origin = of->origin;
  layer.background = of->background;
  codeDivisor(in, layer.divisor);
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

namespace {

/// The checksum of all that a section of related voxels depends on.
std::uint64_t checksumOfRelated(const VoxelLayer& layer, const VoxelReference& reference,
                                const VoxelLayer& context) {
  ByteWriter all;
  putReference(all, reference);
  all.put(checksumOf(layer));
  all.put(checksumOf(context));
  RunningChecksum sum;
  sum.add(all.take());
  return sum.value();
}

}  // namespace

std::optional<std::vector<std::byte>> putRelated(const VoxelLayer& layer,
                                                 const VoxelReference& reference,
                                                 const VoxelLayer* of) {
  const VoxelLayer empty = emptyAt(layer);
  const VoxelLayer& context = of ? *of : empty;
  const CodedVoxels& kept = layer.related;
  if (kept.section && kept.checksum == checksumOfRelated(layer, reference, context))
    return *kept.section;
  if (!codec::isPredictable(layer, context)) return std::nullopt;
  ByteWriter out;
  putReference(out, reference);
  putRelatedHead(out, layer, of);
  out.putAll(encodePredicted(layer, codec::PastVoxels(context, layer, mapOf(reference))));
  return out.take();
}

void keepRelated(VoxelLayer& layer, const VoxelReference& reference, const VoxelLayer* of) {
  auto content = putRelated(layer, reference, of);
  if (!content) return;
  layer.related = {checksumOfRelated(layer, reference, of ? *of : emptyAt(layer)),
                   std::make_shared<const std::vector<std::byte>>(std::move(*content))};
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
