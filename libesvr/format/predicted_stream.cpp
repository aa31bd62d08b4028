#include "format/predicted_stream.h"

#include <algorithm>

#include "codec/brick_order.h"
#include "codec/frame_coder.h"
#include "format/voxel_section.h"

namespace esvr::format {
namespace {

/// The number of bricks that the context has not.
std::uint64_t newBricks(const VoxelLayer& layer, const codec::PastVoxels& past) {
  return std::uint64_t(std::ranges::count_if(
      layer.bricks, [&](const Coord brick) { return past.find(brick) == BrickIndex::kNone; }));
}

}  // namespace

std::vector<std::byte> encodePredicted(const VoxelLayer& layer, const codec::PastVoxels& past) {
  codec::Writer writer;
  VoxelLayer written = layer;
  codec::codeFrameBricks(writer, past, written.bricks);
  codec::codeFrameVoxels(writer, codec::codingOrder(written.bricks), past, written);
  auto stream = writer.coder.finish();
  stream.resize(std::max<std::uint64_t>(stream.size(), bytesForBricks(newBricks(layer, past))));
  return stream;
}

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

}  // namespace esvr::format
