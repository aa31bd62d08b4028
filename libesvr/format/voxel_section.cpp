#include "format/voxel_section.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

#include "core/morton.h"
#include "esvr/error.h"
#include "format/byte_reader.h"
#include "format/byte_writer.h"
#include "format/cell_tree.h"
#include "format/voxel_coder.h"

namespace esvr::format {
namespace {

/// A reader must know how many bricks a byte can hold before it allocates: the writer adds zeros
/// where there would be more.
constexpr std::uint64_t kMostBricksAByte = 4;
constexpr int kMaxBrickBits = 21;

std::uint64_t keyOf(Coord brick) {
  return spreadBits(std::uint64_t(brick.x)) | spreadBits(std::uint64_t(brick.y)) << 1 |
         spreadBits(std::uint64_t(brick.z)) << 2;
}
Coord brickAt(std::uint64_t key) {
  return {std::int32_t(gatherBits(key)), std::int32_t(gatherBits(key >> 1)),
          std::int32_t(gatherBits(key >> 2))};
}

/// Bricks in Morton order: none comes before one that is nowhere above it.
std::vector<std::size_t> codingOrder(const std::vector<Coord>& bricks) {
  std::vector<std::size_t> order(bricks.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return keyOf(bricks[a]) < keyOf(bricks[b]); });
  return order;
}

int bitsOf(const std::vector<Coord>& bricks) {
  std::uint32_t all = 0;
  for (const Coord b : bricks) all |= std::uint32_t(b.x) | std::uint32_t(b.y) | std::uint32_t(b.z);
  const int bits = std::bit_width(all);
  if (bits > kMaxBrickBits)
    throw RuntimeFailure("cannot store voxels: the grid's bricks lie too far apart");
  return bits;
}

/// What the coder takes vacant voxels for. Any would do: a code near the background serves best.
std::int32_t vacantCodeOf(const VoxelLayer& layer) {
  for (std::size_t i = 0; i < layer.codes.size(); ++i)
    if (layer.vacant[i / kBrickVoxels].test(int(i % kBrickVoxels))) return layer.codes[i];
  return 0;
}

VoxelLayer getHeader(ByteReader& in) {
  VoxelLayer layer;
  layer.form = in.getEnum(VoxelForm::kPalette, "form of voxels");
  layer.divisor = in.get<double>();
  if (!(std::isfinite(layer.divisor) && layer.divisor > 0.0)) in.fail("the divisor of voxels");
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

/// Codes that no value belongs to.
void checkCodes(const VoxelLayer& layer, const ByteReader& in) {
  if (layer.form != VoxelForm::kPalette) return;
  for (const auto code : layer.codes)
    if (code < 0 || std::uint32_t(code) >= layer.palette.size())
      in.fail("a voxel is not in the palette");
}

void setBricks(std::span<const std::uint64_t> keys, const ByteReader& in, VoxelLayer& layer) {
  for (const auto key : keys) layer.bricks.push_back(brickAt(key));
  std::sort(layer.bricks.begin(), layer.bricks.end());
  if (std::adjacent_find(layer.bricks.begin(), layer.bricks.end()) != layer.bricks.end())
    in.fail("a brick of voxels is there twice");
  const auto beyond = [](std::int32_t origin, std::int32_t brick) {
    return std::int64_t(origin) + std::int64_t(brick + 1) * kBrickSide - 1 > Box::kMax;
  };
  for (const Coord b : layer.bricks)
    if (beyond(layer.origin.x, b.x) || beyond(layer.origin.y, b.y) || beyond(layer.origin.z, b.z))
      in.fail("a brick of voxels lies outside the index space");
}

void decodeStream(ByteReader& in, std::uint64_t bricks, int bits, std::int32_t vacantCode,
                  VoxelLayer& layer) {
  Reader reader{RangeDecoder(in.getBytes(in.left()))};
  std::vector<std::uint64_t> keys(bricks);
  CellTree<Reader>(reader).code(keys, 3 * bits);
  setBricks(keys, in, layer);
  layer.codes.resize(bricks * kBrickVoxels);
  layer.active.resize(bricks);
  layer.vacant.resize(bricks);
  codeVoxels(reader, codingOrder(layer.bricks), vacantCode, layer);
}

}  // namespace

std::vector<std::byte> putVoxels(const VoxelLayer& layer) {
  const int bits = bitsOf(layer.bricks);
  const auto order = codingOrder(layer.bricks);
  const std::int32_t vacantCode = vacantCodeOf(layer);
  std::vector<std::uint64_t> keys;
  for (const auto b : order) keys.push_back(keyOf(layer.bricks[b]));
  Writer writer;
  CellTree<Writer>(writer).code(keys, 3 * bits);
  VoxelLayer written = layer;
  codeVoxels(writer, order, vacantCode, written);

  ByteWriter out;
  out.put(std::uint8_t(layer.form));
  out.put(layer.divisor);
  for (const auto at : {layer.origin.x, layer.origin.y, layer.origin.z}) out.put(at);
  out.put(layer.background);
  out.put(std::uint32_t(layer.palette.size()));
  out.putAll(layer.palette);
  out.put(std::uint64_t(layer.bricks.size()));
  out.put(std::uint8_t(bits));
  out.put(vacantCode);
  out.putAll(writer.coder.finish());
  out.padTo(std::max<std::uint64_t>(
      out.size(), (layer.bricks.size() + kMostBricksAByte - 1) / kMostBricksAByte));
  return out.take();
}

VoxelLayer getVoxels(std::span<const std::byte> content, const std::string& where) {
  ByteReader in(content, where);
  VoxelLayer layer = getHeader(in);
  const auto bricks = in.get<std::uint64_t>();
  if (bricks / kMostBricksAByte > content.size())
    in.fail(std::to_string(content.size()) + " bytes of content for " + std::to_string(bricks) +
            " bricks");
  const int bits = in.get<std::uint8_t>();
  if (bits > kMaxBrickBits) in.fail("bricks of voxels lie too far apart");
  const auto vacantCode = in.get<std::int32_t>();
  try {
    decodeStream(in, bricks, bits, vacantCode, layer);
  } catch (const BadInput& error) {
    in.fail(error.what());
  }
  checkCodes(layer, in);
  const SparseVolume volume = volumeOf(layer);
  if (!std::all_of(volume.values.begin(), volume.values.end(),
                   [](float v) { return std::isfinite(v); }))
    in.fail("a voxel is not finite");
  return layer;
}

}  // namespace esvr::format
