#include "format/voxel_section.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "codec/brick_coder.h"
#include "codec/voxel_coder.h"
#include "core/counted.h"
#include "esvr/error.h"

namespace esvr::format {
namespace {

/// Limit on the number of bricks in a byte, so that a reader knows it before it allocates memory.
/// The writer adds zeros where there would be more.
constexpr std::uint64_t kMaxBricksPerByte = 4;

/// Bytes of memory that a brick takes while it is read: its codes, its masks, and its values.
constexpr std::uint64_t kCodeBytesPerBrick = kBrickVoxels * sizeof(std::int32_t);
constexpr double kVoxelBytesPerBrick = double(kCodeBytesPerBrick) + kBrickVoxels * sizeof(float);
constexpr double kEntryBytesPerBrick = 3.0 * sizeof(BrickMask) + 64.0;

double decodedBytesPerBrick(std::uint64_t bricks, const VoxelMemory& memory) {
  return kEntryBytesPerBrick +
         (memory.isInFile(bricks * kCodeBytesPerBrick) ? 0.0 : kVoxelBytesPerBrick);
}

int bitsOf(const std::vector<Coord>& bricks) {
  std::uint32_t all = 0;
  for (const Coord b : bricks) all |= std::uint32_t(b.x) | std::uint32_t(b.y) | std::uint32_t(b.z);
  const int bits = std::bit_width(all);
  if (bits > kMaxBrickBits)
    throw RuntimeFailure("cannot store voxels: the grid's bricks lie too far apart");
  return bits;
}

/// Refuses codes that have no value.
void checkCodes(const VoxelLayer& layer, const ByteReader& in) {
  if (layer.form != VoxelForm::kPalette) return;
  for (const auto code : layer.codes)
    if (code < 0 || std::uint32_t(code) >= layer.palette.size())
      in.fail("a voxel is not in the palette");
}

void setBricks(std::span<const std::uint64_t> keys, const ByteReader& in, VoxelLayer& layer) {
  for (const auto key : keys) layer.bricks.push_back(codec::brickAt(key));
  std::sort(layer.bricks.begin(), layer.bricks.end());
  if (std::adjacent_find(layer.bricks.begin(), layer.bricks.end()) != layer.bricks.end())
    in.fail("a brick of voxels is there twice");
  checkBricks(layer, in);
}

void putModel(ByteWriter& out, const codec::VoxelModel& model) {
  out.put(model.vacantCode);
  for (const auto mirror : model.mirror) out.put(mirror);
  out.put(std::uint8_t(model.common.size()));
  out.putAll(model.common);
}

codec::VoxelModel getModel(ByteReader& in) {
  codec::VoxelModel model;
  model.vacantCode = in.get<std::int32_t>();
  for (auto& mirror : model.mirror) {
    mirror = in.get<std::int32_t>();
    if (mirror < codec::VoxelModel::kNoMirror) in.fail("a mirror of voxels");
  }
  model.common.resize(in.get<std::uint8_t>());
  if (model.common.size() > codec::VoxelModel::kMaxCommon) in.fail("too many common voxels");
  for (auto& code : model.common) code = in.get<std::int32_t>();
  return model;
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

}  // namespace

void putVoxelHead(ByteWriter& out, const VoxelLayer& layer) {
  out.put(std::uint8_t(layer.form));
  out.put(layer.divisor);
  for (const auto at : {layer.origin.x, layer.origin.y, layer.origin.z}) out.put(at);
  out.put(layer.background);
  out.put(std::uint32_t(layer.palette.size()));
  out.putAll(layer.palette);
}

double getDivisor(ByteReader& in) {
  const auto divisor = in.get<double>();
  if (!(std::isfinite(divisor) && divisor > 0.0)) in.fail("the divisor of voxels");
  return divisor;
}

VoxelLayer getVoxelHead(ByteReader& in) {
  VoxelLayer layer;
  layer.form = in.getEnum(VoxelForm::kPalette, "form of voxels");
  layer.divisor = getDivisor(in);
  layer.origin.x = in.get<std::int32_t>();
  layer.origin.y = in.get<std::int32_t>();
  layer.origin.z = in.get<std::int32_t>();
  if (localOf(layer.origin) != Coord{}) in.fail("the origin of voxels is not a brick's corner");
  layer.background = in.get<float>();
  if (!std::isfinite(layer.background)) in.fail("the background of voxels is not finite");
  const auto values = in.get<std::uint32_t>();
  if (values > in.left() / sizeof(float)) in.fail("ends within the palette of voxels");
  layer.palette.resize(values);
  for (float& value : layer.palette) value = in.get<float>();
  return layer;
}

std::uint64_t maxBricksIn(std::uint64_t bytes) {
  return kMaxBricksPerByte * bytes + kMaxBricksPerByte - 1;
}

std::uint64_t bytesForBricks(std::uint64_t bricks) {
  return (bricks + kMaxBricksPerByte - 1) / kMaxBricksPerByte;
}

void takeBricks(std::uint64_t bricks, const std::string& where, MemoryBudget& budget) {
  budget.take(double(bricks) * decodedBytesPerBrick(bricks, budget.voxels()), where);
}

void checkBricks(const VoxelLayer& layer, const ByteReader& in) {
  const auto beyond = [](std::int32_t origin, std::int32_t brick) {
    return std::int64_t(origin) + std::int64_t(brick + 1) * kBrickSide - 1 > Box::kMax;
  };
  for (const Coord b : layer.bricks)
    if (beyond(layer.origin.x, b.x) || beyond(layer.origin.y, b.y) || beyond(layer.origin.z, b.z))
      in.fail("a brick of voxels lies outside the index space");
}

void checkVoxels(const VoxelLayer& layer, const ByteReader& in) {
  checkCodes(layer, in);
  if (!allFinite(layer)) in.fail("a voxel is not finite");
}

std::vector<std::byte> putVoxels(const VoxelLayer& layer) {
  const int bits = bitsOf(layer.bricks);
  codec::VoxelModel model = codec::chooseModel(layer);
  auto stream = encodeStreams(layer, model, bits);
  if (codec::hasMirror(model)) {
    const codec::VoxelModel plain = codec::withoutMirrors(model);
    auto other = encodeStreams(layer, plain, bits);
    if (other.size() < stream.size()) stream = std::move(other), model = plain;
  }
  ByteWriter out;
  putVoxelHead(out, layer);
  out.put(std::uint64_t(layer.bricks.size()));
  out.put(std::uint8_t(bits));
  putModel(out, model);
  out.putAll(stream);
  out.padTo(std::max<std::uint64_t>(out.size(), bytesForBricks(layer.bricks.size())));
  return out.take();
}

bool takeMore(const VoxelLayer& layer, std::uint64_t bytes) {
  const auto takesMore = [&](const codec::VoxelModel& model) {
    return codec::codeWithin(model, bytes, layer).bytes > bytes;
  };
  const codec::VoxelModel model = codec::chooseModel(layer);
  return takesMore(model) && (!codec::hasMirror(model) || takesMore(codec::withoutMirrors(model)));
}

VoxelLayer getVoxels(std::span<const std::byte> content, const std::string& where,
                     MemoryBudget& budget) {
  ByteReader in(content, where);
  VoxelLayer layer = getVoxelHead(in);
  layer.codes = VoxelArray<std::int32_t>(budget.voxels());
  const BrickCount count = getBrickCount(in, content.size());
  takeBricks(count.bricks, where, budget);
  const codec::VoxelModel model = getModel(in);
  decodeStreams(in, count, model, layer);
  checkVoxels(layer, in);
  return layer;
}

}  // namespace esvr::format
